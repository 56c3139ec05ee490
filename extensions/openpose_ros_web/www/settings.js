// What is shown.
export const SWITCHES = [
  // name, text, key, at first
  ['labels', 'Ids, postures, gestures', 'l', true],
  ['velocity', 'Velocities', 'v', true],
  ['pointing', 'Pointing rays', 'p', true],
  ['hands', 'Hands', 'h', true],
  ['faces', 'Faces', 'e', true],
  ['sigma', 'Uncertainty (sigma)', 's', false],
  ['cameras', 'Cameras', 'c', true],
  ['grid', 'Floor', 'g', true],
  ['image', 'Image', 'i', true]]

export class Settings {
  constructor() {
    this.listeners = []
    for (const [name, , , first] of SWITCHES) this[name] = first
  }

  onChange(listener) {
    this.listeners.push(listener)
  }

  set(name, value) {
    this[name] = value
    this.listeners.forEach(listener => listener())
  }
}
