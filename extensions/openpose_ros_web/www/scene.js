// The view in 3D: draws the newest messages when there are some, or the view moves.
import {ColorManagement, DirectionalLight, HemisphereLight, LinearSRGBColorSpace, Scene as World, WebGLRenderer}
  from './vendor/three.module.min.js'
import {Bodies} from './bodies.js'
import {Labels} from './labels.js'
import {GROUND, Scenery} from './scenery.js'
import {Signs} from './signs.js'
import {metres} from './state.js'
import {View} from './view.js'

ColorManagement.enabled = false // colours are drawn as the messages have them

export class Scene {
  // `drawn` is called after each drawing.
  constructor(canvas, labels, state, settings, drawn) {
    this.renderer = new WebGLRenderer({canvas, antialias: true})
    this.renderer.outputColorSpace = LinearSRGBColorSpace
    this.canvas = canvas
    this.state = state
    this.settings = settings
    this.drawn = drawn
    this.shown = [] // the people of the newest drawing
    this.world = new World()
    this.world.add(new HemisphereLight(0xffffff, 0xb0b0b0, 2.4))
    this.light = new DirectionalLight(0xffffff, 1)
    this.world.add(this.light)
    this.view = new View(canvas, () => this.redraw())
    this.scenery = new Scenery(this.world)
    this.signs = new Signs(this.world)
    this.labels = new Labels(labels)
    state.on('hello', hello => this.begin(hello))
    for (const kind of ['people', 'signals', 'hands', 'faces', 'cameras']) state.on(kind, message => this.take(message))
    settings.onChange(() => this.redraw())
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement)
    this.renderer.setClearColor(GROUND)
    this.resize()
  }

  begin(hello) {
    this.bodies ??= new Bodies(this.world, hello.look)
    this.scenery.reset()
    this.redraw()
  }

  take(message) {
    if (message.type === 'people' && message.frame !== this.frame) {
      this.frame = message.frame
      this.scenery.reset()
      this.view.fitted = false
    }
    this.redraw()
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement
    if (!width || !height) return
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2))
    this.renderer.setSize(width, height)
    this.view.resize(width, height)
    this.redraw()
  }

  redraw() {
    if (this.waits) return
    this.waits = true
    requestAnimationFrame(() => this.draw())
  }

  draw() {
    this.waits = false
    const {hello, people, cameras} = this.state.messages
    const shown = this.state.people(), seen = camerasOf(cameras, hello)
    this.view.cameras = seen
    this.view.update(shown)
    this.scenery.findFloor(shown, people?.stamp, seen)
    this.scenery.draw(seen, this.view.controls.target, this.view.cameraIndex(), this.settings)
    this.bodies?.draw(shown, this.state.landmarks('hands'), this.state.landmarks('faces'), this.settings)
    this.signs.draw(shown, this.settings)
    this.light.position.copy(this.view.camera.position)
    this.renderer.render(this.world, this.view.camera)
    this.labels.draw(shown, seen, this.settings, this.view)
    this.shown = shown
    this.waits = false // of the view that moved while it was drawn: it is drawn
    this.drawn(shown, seen)
  }

  // Pixels of the window where joints are drawn.
  joints() {
    const {left, top} = this.canvas.getBoundingClientRect()
    return this.shown.flatMap(person => person.points.flatMap((point, joint) => {
      const pixel = this.view.project(point)
      return pixel && person.status[joint]
        ? [{id: person.id, joint: person.names[joint], status: person.status[joint], x: left + pixel[0], y: top + pixel[1]}]
        : []
    }))
  }
}

function camerasOf(message, hello) {
  return (message?.cameras ?? []).map(({camera, size, K, position, rotation}) => ({
    index: camera, name: hello?.cameras[camera] ?? '', size, K, position: metres(position), rotation}))
}
