// The table of people, what the nodes say, and the line about the connection.
import {gestureText, postureText} from './words.js'

const element = id => document.getElementById(id)
const SILENT = 5 // a node whose last report is older is gone [s]
const LEVELS = ['', 'warning', 'error']

export class Panel {
  // `choose` is called with the id of the person whose row is chosen.
  constructor(state, choose) {
    this.rows = new Map()
    this.choose = choose
    state.on('link', ({state: name, text}) => show(element('link'), text, name))
    state.on('state', ({nodes}) => this.showNodes(nodes))
  }

  // `camera`: distances are from its position, or from the origin.
  showPeople(people, camera, followed, theme) {
    const seen = new Set(people.map(person => person.id))
    for (const [id, row] of this.rows) {
      if (!seen.has(id)) {
        row.remove()
        this.rows.delete(id)
      }
    }
    for (const person of people) {
      const row = this.rows.get(person.id) ?? this.addRow(person.id)
      const [name, distance, posture, gesture] = row.children
      name.style.borderLeftColor = `rgb(${theme.shade(person.rgb).map(Math.round).join(' ')})`
      show(name.firstChild, String(person.id))
      show(distance, distanceText(person, camera))
      show(posture, person.signals ? postureText(person.signals) : '', person.signals?.fallen ? 'alarm' : '')
      show(gesture, person.signals ? person.signals.gestures.map(gestureText).join(', ') : '')
      row.classList.toggle('followed', followed === person.id)
    }
    element('none').hidden = people.length > 0
  }

  addRow(id) {
    const row = document.createElement('tr')
    row.append(...Array.from({length: 4}, () => document.createElement('td')))
    const button = document.createElement('button')
    button.type = 'button'
    button.title = 'Follow'
    row.firstChild.append(button)
    row.onclick = () => this.choose(id)
    this.rows.set(id, row)
    element('people').append(row)
    return row
  }

  showNodes(nodes) {
    element('nodes').replaceChildren(...nodes.map(({name, level, text, silent = 0}) => {
      const item = document.createElement('li')
      const state = silent > SILENT ? 'error' : LEVELS[level] ?? 'error'
      item.className = state
      const [title, words] = ['strong', 'span'].map(tag => document.createElement(tag))
      title.textContent = name
      words.textContent = silent > SILENT ? `silent for ${silent} s; before: ${text}` : state ? `${state}: ${text}` : text
      item.append(title, ' ', words)
      return item
    }))
  }

  showFigures({rate, latency}) {
    const parts = [rate && `${rate.toFixed(1)} Hz`, latency !== null && `${Math.round(latency * 1000)} ms`]
    show(element('figures'), parts.filter(Boolean).join(' · '))
  }
}

function distanceText({middle}, camera) {
  if (!middle) return ''
  const from = camera?.position ?? [0, 0, 0]
  return `${Math.hypot(...middle.map((value, axis) => value - from[axis])).toFixed(1)} m`
}

function show(place, text, name) {
  if (place.textContent !== text) place.textContent = text
  if (name !== undefined && place.className !== name) place.className = name
}
