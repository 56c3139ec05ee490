// Plays a recording: time, speed, keyboard, and what else is shown over time.
import {saveTable} from './csv.js'
import {Timeline} from './timeline.js'
import {make} from './menu.js'
import {lastBefore} from './recording.js'

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8]
const STEP = 1, LONG_STEP = 10 // of the arrow keys [s]
const KEYS = [['Space', 'Play or pause'], ['← →', '1 s back or ahead, 10 s with Shift'], [', .', 'Frame back or ahead']]

export class Player {
  constructor(recording, source) {
    this.recording = recording
    this.source = source
    this.end = recording.stamps[recording.stamps.length - 1]
    this.time = 0
    this.playing = false
    this.build()
    this.timeline = new Timeline(this.section, recording, Math.max(this.end, 0.001), time => this.seek(time))
    document.getElementById('help_keys').append(...KEYS.flatMap(([key, text]) =>
      [make('dt', {textContent: key}), make('dd', {textContent: text})]))
    document.addEventListener('keydown', event => this.press(event), {capture: true})
    this.seek(0)
  }

  build() {
    this.section = make('section', {id: 'player'})
    this.button = make('button', {type: 'button', id: 'play', onclick: () => this.play(!this.playing)})
    this.slider = make('input', {type: 'range', id: 'time', min: 0, max: this.end, step: 'any',
      oninput: () => this.seek(Number(this.slider.value))})
    this.slider.setAttribute('aria-label', 'Time')
    this.text = make('output', {id: 'clock'})
    this.speed = make('select', {id: 'speed', onchange: () => { this.last = null }})
    this.speed.setAttribute('aria-label', 'Speed')
    this.speed.append(...SPEEDS.map(speed => make('option', {value: speed, textContent: `${speed}×`, selected: speed === 1})))
    const save = make('button', {type: 'button', id: 'save', textContent: 'Table (CSV)',
      onclick: () => saveTable(this.recording)})
    const bar = make('div', {id: 'controls'})
    bar.append(this.button, this.slider, this.text, this.speed, save)
    this.section.append(bar, ...this.recording.notes.map(note => make('p', {textContent: note})))
    document.querySelector('main').after(this.section)
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
    const {stamps} = this.recording
    const index = lastBefore(stamps, this.time + 1e-6) + frames
    this.seek(stamps[Math.min(Math.max(index, 0), stamps.length - 1)])
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return
    const seconds = event.shiftKey ? LONG_STEP : STEP
    const action = {' ': () => this.play(!this.playing), ArrowLeft: () => this.seek(this.time - seconds),
      ArrowRight: () => this.seek(this.time + seconds), ',': () => this.step(-1), '.': () => this.step(1)}[event.key]
    const elsewhere = event.target.closest('select') || (event.key === ' ' && event.target.closest('button, summary, input'))
    if (!action || elsewhere) return
    event.preventDefault()
    event.stopPropagation()
    action()
  }
}
