// The annotated image: asks for the width that is shown, and draws the newest.
import {make} from './menu.js'

const OLD = 4 // an image is faded [s]

const element = id => document.getElementById(id)

export class Picture {
  // `changed` is called when another image is wanted than before.
  constructor(state, settings, changed) {
    this.canvas = element('image')
    this.figure = element('picture')
    this.select = element('camera')
    this.settings = settings
    this.changed = changed
    this.select.onchange = () => {
      changed()
      this.select.blur() // keys are shortcuts again
    }
    state.on('hello', hello => this.begin(hello))
    state.on('image', image => this.take(image))
    settings.onChange(() => this.update())
    new ResizeObserver(() => changed()).observe(this.figure)
    setInterval(() => this.showAge(), 1000)
  }

  begin(hello) {
    this.hello = hello
    const chosen = this.select.value
    this.select.replaceChildren(...hello.cameras.map((textContent, value) => make('option', {value, textContent})))
    if (hello.cameras[chosen] !== undefined) this.select.value = chosen
    this.select.hidden = hello.cameras.length < 2
    this.update()
  }

  update() {
    this.figure.hidden = !this.settings.image || !this.hello?.cameras.length
    this.changed()
  }

  // Show the image of a camera that has one.
  choose(camera) {
    if (camera === this.camera() || this.hello?.cameras[camera] === undefined) return
    this.select.value = String(camera)
    this.changed()
  }

  camera() {
    return Number(this.select.value || 0)
  }

  // What to ask for; null: no image.
  wish() {
    if (this.figure.hidden || !this.hello) return null
    const shown = this.figure.clientWidth * devicePixelRatio, {widths} = this.hello
    return {camera: this.camera(), width: widths.find(width => width >= shown) ?? widths[widths.length - 1]}
  }

  // The newest image waits while another one is drawn.
  async take(image) {
    if (image.camera !== this.camera()) return
    this.waiting = image
    if (this.busy) return
    this.busy = true
    while (this.waiting) {
      const {jpeg} = this.waiting
      this.waiting = null
      try {
        const bitmap = await createImageBitmap(new Blob([jpeg], {type: 'image/jpeg'}))
        this.canvas.width = bitmap.width
        this.canvas.height = bitmap.height
        this.canvas.getContext('2d').drawImage(bitmap, 0, 0)
        bitmap.close()
        this.last = Date.now()
      } catch {
        // a damaged image
      }
    }
    this.busy = false
  }

  showAge() {
    const age = Math.round((Date.now() - this.last) / 1000)
    element('image_age').textContent = age > OLD ? `${age} s ago` : ''
    this.canvas.classList.toggle('old', age > OLD)
  }
}
