// The annotated image: asks for the width that is shown, and as often as the browser can draw it.
const FIRST_RATE = 10, SLOWEST = 1 // [Hz]
const PERIOD = 2000 // of adapting the rate [ms]
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
    this.rate = FIRST_RATE
    this.drawn = this.dropped = 0
    this.select.onchange = () => {
      changed()
      this.select.blur() // keys are shortcuts again
    }
    state.on('hello', hello => this.begin(hello))
    state.on('image', image => this.take(image))
    settings.onChange(() => this.update())
    new ResizeObserver(() => changed()).observe(this.figure)
    setInterval(() => this.adapt(), PERIOD)
  }

  begin(hello) {
    this.hello = hello
    const chosen = this.select.value
    this.select.replaceChildren(...hello.cameras.map((name, index) => {
      const option = document.createElement('option')
      option.value = String(index)
      option.textContent = name
      return option
    }))
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
    return {camera: this.camera(), width: widths.find(width => width >= shown) ?? widths[widths.length - 1],
      rate: this.rate}
  }

  // The newest image waits while another one is drawn.
  async take(image) {
    const {camera, jpeg} = image
    if (camera !== this.camera()) return
    if (this.busy) {
      if (this.waiting) this.dropped += 1
      this.waiting = image
      return
    }
    this.busy = true
    try {
      const bitmap = await createImageBitmap(new Blob([jpeg], {type: 'image/jpeg'}))
      this.canvas.width = bitmap.width
      this.canvas.height = bitmap.height
      this.canvas.getContext('2d').drawImage(bitmap, 0, 0)
      bitmap.close()
      this.drawn += 1
      this.last = Date.now()
    } catch {
      this.dropped += 1 // a damaged image
    } finally {
      this.busy = false
      const next = this.waiting
      this.waiting = null
      if (next) this.take(next)
    }
  }

  adapt() {
    const {drawn, dropped} = this
    const rate = dropped > 0.2 * (drawn + dropped) ? Math.max(SLOWEST, 0.6 * this.rate)
      : Math.min(this.hello?.image_rate ?? FIRST_RATE, this.rate + 1)
    const age = Math.round((Date.now() - this.last) / 1000)
    element('image_figures').textContent = drawn ? `${(drawn * 1000 / PERIOD).toFixed(0)} Hz · ${this.canvas.width} px`
      : age ? `${age} s ago` : ''
    this.canvas.classList.toggle('old', age > OLD)
    this.drawn = this.dropped = 0
    if (rate === this.rate) return
    this.rate = rate
    this.changed()
  }
}
