// What is shown, remembered by the browser; and the theme that it prefers.
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

const DARK = {ground: [22, 25, 31], grid: 0x4a5261, camera: [150, 160, 175], pale: 255, shade: rgb => rgb}
// lines in full colours are lost on a bright ground
const LIGHT = {ground: [244, 245, 247], grid: 0xaab1bb, camera: [90, 98, 110], pale: 150,
  shade: rgb => rgb.map(value => 0.72 * value)}

export class Settings {
  constructor() {
    this.listeners = []
    const stored = read()
    for (const [name, , , first] of SWITCHES) this[name] = stored[name] ?? first
    this.bright = matchMedia('(prefers-color-scheme: light)')
    this.bright.addEventListener('change', () => this.tell())
  }

  onChange(listener) {
    this.listeners.push(listener)
  }

  set(name, value) {
    this[name] = value
    try {
      localStorage.setItem('people', JSON.stringify({...read(), [name]: value}))
    } catch {
      // not allowed to remember: as long as the page is open
    }
    this.tell()
  }

  theme() {
    return this.bright.matches ? LIGHT : DARK
  }

  tell() {
    this.listeners.forEach(listener => listener())
  }
}

function read() {
  try {
    return {...JSON.parse(localStorage.getItem('people'))}
  } catch {
    return {}
  }
}
