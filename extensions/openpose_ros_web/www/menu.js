// Choice of the view, switches, theme, and keyboard.
import {SWITCHES} from './settings.js'

const element = id => document.getElementById(id)

export class Menu {
  // `actions`: setView(mode), fit(), followNext().
  constructor(settings, actions) {
    this.settings = settings
    this.actions = actions
    this.select = element('view')
    this.select.onchange = () => {
      actions.setView(this.select.value)
      this.select.blur() // keys are shortcuts again
    }
    this.boxes = new Map(SWITCHES.map(([name, text, key]) => [name, this.addSwitch(name, text, key)]))
    element('theme').onclick = () => settings.switchTheme()
    this.keys = new Map([
      ['0', ['See all people', () => actions.fit()]],
      ['a', ['From above', () => actions.setView('above')]],
      ['f', ['Follow the next person', () => actions.followNext()]],
      ...SWITCHES.map(([name, text, key]) => [key, [text, () => settings.set(name, !settings[name])]]),
      ['d', ['Dark or light', () => settings.switchTheme()]],
      ['?', ['This help', () => this.help()]]])
    this.fillHelp()
    document.addEventListener('keydown', event => this.press(event))
    settings.onChange(() => this.update())
    this.update()
  }

  addSwitch(name, text, key) {
    const label = document.createElement('label'), box = document.createElement('input')
    box.type = 'checkbox'
    box.onchange = () => this.settings.set(name, box.checked)
    label.append(box, ` ${text} `, make('kbd', {textContent: key}))
    element('switches').append(label)
    return box
  }

  update() {
    this.boxes.forEach((box, name) => { box.checked = this.settings[name] })
    element('theme').textContent = this.settings.themeName === 'dark' ? 'Light' : 'Dark'
  }

  // Offer a switch or not.
  offer(name, offered) {
    this.boxes.get(name).parentElement.hidden = !offered
  }

  // The views that there are now, and the chosen one.
  showViews(views, chosen) {
    const wanted = JSON.stringify(views)
    if (wanted !== this.views && document.activeElement !== this.select) {
      this.views = wanted
      this.select.replaceChildren(...views.map(([mode, text]) => {
        const option = make('option', {textContent: text})
        option.value = mode
        return option
      }))
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
    action[1]()
  }

  fillHelp() {
    const lines = [...this.keys].map(([key, [text]]) => [key, text])
    lines.splice(1, 0, ['1 to 9', 'From a camera'])
    element('help_keys').append(...lines.flatMap(([key, text]) => {
      const term = document.createElement('dt')
      term.append(make('kbd', {textContent: key}))
      return [term, make('dd', {textContent: text})]
    }))
    element('keys').onclick = () => this.help()
    element('help_close').onclick = () => element('help').close()
  }

  help() {
    const help = element('help')
    if (help.open) help.close()
    else help.showModal()
  }
}

export function make(tag, values) {
  return Object.assign(document.createElement(tag), values)
}
