// Texts over the view: ids with what people do, and names of cameras.
import {make} from './menu.js'
import {gestureText, postureText} from './words.js'

const ABOVE = 0.18, BELOW = 0.12 // of heads and cameras [m]

export class Labels {
  constructor(parent) {
    this.parent = parent
    this.shown = new Map()
  }

  draw(people, cameras, settings, view) {
    const wanted = new Map()
    for (const {id, rgb, middle, top, signals} of settings.labels ? people : []) {
      if (!middle) continue
      const signs = signals ? [postureText(signals), ...signals.gestures.map(gestureText)].filter(Boolean) : []
      wanted.set(`person ${id}`, {lines: [String(id), ...signs], rgb, fallen: signals?.fallen,
        point: [middle[0], middle[1], top + ABOVE]})
    }
    for (const {name, position: [x, y, z]} of settings.cameras ? cameras : []) {
      wanted.set(`camera ${name}`, {lines: [name], point: [x, y, z - BELOW]})
    }
    for (const [key, element] of this.shown) {
      if (!wanted.has(key)) {
        element.remove()
        this.shown.delete(key)
      }
    }
    for (const [key, label] of wanted) this.put(key, label, view.project(label.point), view.distance(label.point))
  }

  put(key, {lines, rgb, fallen}, pixel, distance) {
    const element = this.shown.get(key) ?? this.parent.appendChild(make('div', {}))
    this.shown.set(key, element)
    element.hidden = pixel === null
    if (pixel === null) return
    const text = lines.join('\n')
    if (element.textContent !== text) element.textContent = text
    element.className = rgb ? `person${fallen ? ' fallen' : ''}` : 'camera'
    Object.assign(element.style, {zIndex: Math.round(1000 - 10 * distance),
      borderColor: rgb ? `rgb(${rgb.join(' ')})` : '',
      transform: `translate(-50%, -100%) translate(${pixel[0].toFixed(1)}px, ${pixel[1].toFixed(1)}px)`})
  }
}
