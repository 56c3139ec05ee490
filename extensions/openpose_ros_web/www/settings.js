// What is shown, and the theme; remembered by the browser.
export const SWITCHES = [
  // name, text, key, at first
  ['labels', 'Ids, postures, gestures', 'l', true],
  ['velocity', 'Velocities', 'v', true],
  ['pointing', 'Pointing rays', 'p', true],
  ['trails', 'Trails', 't', true],
  ['hands', 'Hands', 'h', true],
  ['faces', 'Faces', 'e', true],
  ['sigma', 'Uncertainty (sigma)', 's', false],
  ['cameras', 'Cameras', 'c', true],
  ['grid', 'Floor', 'g', true],
  ['cloud', 'Coloured cloud', 'o', false],
  ['image', 'Image', 'i', true]]

const THEMES = {
  dark: {ground: [22, 25, 31], grid: 0x4a5261, camera: [150, 160, 175], pale: 255, shade: rgb => rgb},
  // lines in full colours are lost on a bright ground
  light: {ground: [244, 245, 247], grid: 0xaab1bb, camera: [90, 98, 110], pale: 150,
    shade: rgb => rgb.map(value => 0.72 * value)}}

export class Settings {
  constructor() {
    this.listeners = []
    this.stored = read()
    for (const [name, , , first] of SWITCHES) this[name] = this.stored[name] ?? first
    this.bright = matchMedia('(prefers-color-scheme: light)')
    this.bright.addEventListener('change', () => this.tell())
    this.apply()
  }

  onChange(listener) {
    this.listeners.push(listener)
  }

  set(name, value) {
    this[name] = value
    this.keep(name, value)
  }

  theme() {
    return THEMES[this.themeName]
  }

  switchTheme() {
    this.keep('theme', this.themeName === 'dark' ? 'light' : 'dark')
  }

  keep(name, value) {
    this.stored[name] = value
    try {
      localStorage.setItem('people', JSON.stringify(this.stored))
    } catch {
      // not allowed to remember: as long as the page is open
    }
    this.tell()
  }

  tell() {
    this.apply()
    this.listeners.forEach(listener => listener())
  }

  apply() {
    this.themeName = this.stored.theme in THEMES ? this.stored.theme : this.bright.matches ? 'light' : 'dark'
    document.documentElement.dataset.theme = this.themeName
  }
}

function read() {
  try {
    const stored = JSON.parse(localStorage.getItem('people'))
    return stored !== null && typeof stored === 'object' ? stored : {}
  } catch {
    return {}
  }
}
