// Plays the recording of a source: time, speed, keyboard, and what else is shown over time.
import {make} from './menu.js'
import {lastBefore} from './recording.js'
import {Timeline} from './timeline.js'

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8]
const STEP = 1, LONG_STEP = 10 // of the arrow keys [s]

export class Player {
  constructor(source) {
    this.source = source
    const {recording} = source
    this.end = recording.stamps[recording.stamps.length - 1]
    this.time = 0
    this.playing = false
    this.button = make('button', {type: 'button', id: 'play', title: 'Space', onclick: () => this.play(!this.playing)})
    this.slider = make('input', {type: 'range', id: 'time', min: 0, max: this.end, step: 'any', ariaLabel: 'Time',
      title: '← →: 1 s, with Shift 10 s; comma, point: a frame', oninput: () => this.seek(Number(this.slider.value))})
    this.text = make('output', {id: 'clock'})
    this.speed = make('select', {id: 'speed', ariaLabel: 'Speed', onchange: () => { this.last = null }})
    this.speed.append(...SPEEDS.map(value => make('option', {value, textContent: `${value}×`, selected: value === 1})))
    const bar = make('div', {id: 'controls'}), section = make('section', {id: 'player'})
    bar.append(this.button, this.slider, this.text, this.speed)
    section.append(bar, ...recording.notes.map(note => make('p', {textContent: note})))
    document.querySelector('main').after(section)
    this.timeline = new Timeline(section, recording, Math.max(this.end, 0.001), time => this.seek(time))
    document.addEventListener('keydown', event => this.press(event), {capture: true})
    this.seek(0)
  }

  play(playing) {
    if (playing && this.time >= this.end) this.time = 0
    this.playing = playing
    this.last = null
    this.show()
    if (playing) requestAnimationFrame(now => this.tick(now))
  }

  tick(now) {
    if (!this.playing) return
    if (this.last !== null) this.time += (now - this.last) / 1000 * Number(this.speed.value)
    this.last = now
    if (this.time >= this.end) {
      this.time = this.end
      this.playing = false
    }
    this.show()
    requestAnimationFrame(later => this.tick(later))
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.end)
    this.last = null
    this.show()
  }

  show() {
    this.source.show(this.time)
    this.slider.value = this.time
    this.text.textContent = `${this.time.toFixed(1)} of ${this.end.toFixed(1)} s`
    this.button.textContent = this.playing ? 'Pause' : 'Play'
    this.timeline.showTime(this.time)
  }

  step(frames) {
    const {stamps} = this.source.recording
    const index = lastBefore(stamps, this.time + 1e-6) + frames
    this.seek(stamps[Math.min(Math.max(index, 0), stamps.length - 1)])
  }

  press(event) {
    const seconds = event.shiftKey ? LONG_STEP : STEP
    const action = {' ': () => this.play(!this.playing), ArrowLeft: () => this.seek(this.time - seconds),
      ArrowRight: () => this.seek(this.time + seconds), ',': () => this.step(-1), '.': () => this.step(1)}[event.key]
    const elsewhere = event.target.closest('select') || (event.key === ' ' && event.target.closest('button, summary, input'))
    if (!action || elsewhere || event.ctrlKey || event.metaKey || event.altKey) return
    event.preventDefault()
    event.stopPropagation()
    action()
  }
}
