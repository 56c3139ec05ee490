// Texts over the view: ids with what people do, and names of cameras.
import {gestureText, postureText} from './words.js'

const ABOVE = 0.18, BELOW = 0.12 // of heads and cameras [m]

export class Labels {
  constructor(parent) {
    this.parent = parent
    this.shown = new Map()
  }

  draw(people, cameras, settings, theme, view) {
    const wanted = new Map()
    if (settings.labels) {
      for (const person of people) {
        if (!person.middle) continue
        const lines = [String(person.id), ...signsOf(person.signals)]
        wanted.set(`person ${person.id}`, {lines, rgb: theme.shade(person.rgb), fallen: person.signals?.fallen,
          point: [person.middle[0], person.middle[1], person.top + ABOVE]})
      }
    }
    if (settings.cameras) cameras.forEach(({name, position}) => wanted.set(`camera ${name}`, {lines: [name], point: [position[0], position[1], position[2] - BELOW]}))
    for (const [key, element] of this.shown) {
      if (!wanted.has(key)) {
        element.remove()
        this.shown.delete(key)
      }
    }
    for (const [key, label] of wanted) this.put(key, label, view.project(label.point), view.distance(label.point))
  }

  put(key, {lines, rgb, fallen}, pixel, distance) {
    const element = this.shown.get(key) ?? this.parent.appendChild(document.createElement('div'))
    this.shown.set(key, element)
    element.hidden = pixel === null
    if (pixel === null) return
    const text = lines.join('\n')
    if (element.textContent !== text) element.textContent = text
    element.className = rgb ? 'person' : 'camera'
    element.classList.toggle('fallen', Boolean(fallen))
    element.style.zIndex = String(Math.round(1000 - 10 * distance))
    element.style.borderColor = rgb ? `rgb(${rgb.map(Math.round).join(' ')})` : ''
    element.style.transform = `translate(-50%, -100%) translate(${pixel[0].toFixed(1)}px, ${pixel[1].toFixed(1)}px)`
  }
}

function signsOf(signals) {
  if (!signals) return []
  return [postureText(signals), ...signals.gestures.map(gestureText)].filter(Boolean)
}
