// Choice of the view, switches, and their keys.
import {SWITCHES} from './settings.js'

export class Menu {
  // `actions`: setView(mode), fit(), followNext().
  constructor(settings, actions) {
    this.actions = actions
    this.select = document.getElementById('view')
    this.select.onchange = () => {
      actions.setView(this.select.value)
      this.select.blur() // keys are shortcuts again
    }
    this.boxes = new Map(SWITCHES.map(([name, text, key]) => {
      const box = make('input', {type: 'checkbox', onchange: () => settings.set(name, box.checked)})
      const label = make('label', {})
      label.append(box, ` ${text} `, make('kbd', {textContent: key}))
      document.getElementById('switches').append(label)
      return [name, box]
    }))
    this.keys = new Map([['0', actions.fit], ['a', () => actions.setView('above')], ['f', actions.followNext],
      ...SWITCHES.map(([name, , key]) => [key, () => settings.set(name, !settings[name])])])
    document.addEventListener('keydown', event => this.press(event))
    const update = () => this.boxes.forEach((box, name) => { box.checked = settings[name] })
    settings.onChange(update)
    update()
  }

  // The views that there are now, and the chosen one.
  showViews(views, chosen) {
    const wanted = JSON.stringify(views)
    if (wanted !== this.views && document.activeElement !== this.select) {
      this.views = wanted
      this.select.replaceChildren(...views.map(([value, textContent]) => make('option', {value, textContent})))
    }
    if (this.select.value !== chosen) this.select.value = chosen
  }

  press(event) {
    const inField = event.target.closest('input:not([type=checkbox]), select, textarea')
    if (event.ctrlKey || event.metaKey || event.altKey || inField) return
    if (/^[1-9]$/.test(event.key)) return this.actions.setView(`camera ${event.key - 1}`)
    const action = this.keys.get(event.key.toLowerCase())
    if (!action) return
    event.preventDefault()
    action()
  }
}

export function make(tag, values) {
  return Object.assign(document.createElement(tag), values)
}
