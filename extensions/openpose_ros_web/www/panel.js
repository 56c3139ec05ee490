// The table of people, what the nodes say, and the line about the connection.
import {make} from './menu.js'
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
    state.on('state', message => this.showState(message))
  }

  // `camera`: distances are from its position, or from the origin; `mode` of the view.
  showPeople(people, camera, mode) {
    const seen = new Set(people.map(person => person.id))
    for (const [id, row] of this.rows) {
      if (!seen.has(id)) {
        row.remove()
        this.rows.delete(id)
      }
    }
    for (const {id, rgb, middle, signals} of people) {
      const row = this.rows.get(id) ?? this.addRow(id)
      const [name, distance, posture, gesture] = row.children
      name.style.borderLeftColor = `rgb(${rgb.join(' ')})`
      show(name.firstChild, String(id))
      show(distance, distanceText(middle, camera))
      show(posture, signals ? postureText(signals) : '', signals?.fallen ? 'alarm' : '')
      show(gesture, signals ? signals.gestures.map(gestureText).join(', ') : '')
      row.classList.toggle('followed', mode === `person ${id}`)
    }
    element('none').hidden = people.length > 0
  }

  addRow(id) {
    const row = make('tr', {onclick: () => this.choose(id)})
    row.append(...Array.from({length: 4}, () => make('td', {})))
    row.firstChild.append(make('button', {type: 'button', title: 'Follow'}))
    this.rows.set(id, row)
    element('people').append(row)
    return row
  }

  showState({rate, latency, nodes}) {
    const parts = [rate && `${rate.toFixed(1)} Hz`, latency !== null && `${Math.round(latency * 1000)} ms`]
    show(element('figures'), parts.filter(Boolean).join(' · '))
    element('nodes').replaceChildren(...nodes.map(itemOf))
  }
}

// The item of a node in the list.
function itemOf({name, level, text, silent = 0}) {
  const className = silent > SILENT ? 'error' : LEVELS[level] ?? 'error', item = make('li', {className})
  const words = silent > SILENT ? `silent for ${silent} s; before: ${text}` : className ? `${className}: ${text}` : text
  item.append(make('strong', {textContent: name}), ' ', make('span', {textContent: words}))
  return item
}

function distanceText(middle, camera) {
  if (!middle) return ''
  const from = camera?.position ?? [0, 0, 0]
  return `${Math.hypot(...middle.map((value, axis) => value - from[axis])).toFixed(1)} m`
}

function show(place, text, name) {
  if (place.textContent !== text) place.textContent = text
  if (name !== undefined && place.className !== name) place.className = name
}
