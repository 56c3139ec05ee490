// Where the scene is seen from: free, following a person, from above, or from a camera.
import {Matrix4, PerspectiveCamera, Vector3} from './vendor/three.module.min.js'
import {OrbitControls} from './vendor/OrbitControls.js'

const ANGLE = 50 // field of view [degrees]
const NEAREST = 3.2 // distance to the people at first [m]
const FOLLOWS = 0.3 // share of the way to a followed person per frame

export class View {
  constructor(canvas, changed) {
    this.camera = new PerspectiveCamera(ANGLE, 1, 0.05, 200)
    this.camera.up.set(0, 0, 1)
    this.controls = new OrbitControls(this.camera, canvas)
    this.controls.maxDistance = 60
    this.controls.addEventListener('change', changed)
    this.mode = 'free'
    this.cameras = []
    this.size = [1, 1]
    this.fitted = false
    this.changed = changed
    for (const kind of ['pointerdown', 'wheel']) canvas.addEventListener(kind, () => this.leaveCamera(), {capture: true})
    this.fit([])
  }

  // Modes: 'free', 'above', 'person ID' and 'camera INDEX'.
  setMode(mode, people) {
    const [kind, which] = mode.split(' ')
    if (kind === 'camera' && !this.cameras.some(({index}) => index === Number(which))) return
    if (kind !== 'camera') this.leaveCamera()
    this.mode = mode
    this.controls.enabled = kind !== 'camera'
    this.lookThrough(this.cameraIndex())
    if (kind === 'above') this.fit(people, [0.02, 1])
    if (kind === 'person') this.follow(people, 1)
    this.changed()
  }

  resize(width, height) {
    this.size = [width, height]
    this.camera.aspect = width / height
    this.camera.updateProjectionMatrix()
    this.lookThrough(this.cameraIndex())
  }

  update(people) {
    if (!this.fitted && this.cameraIndex() < 0 && people.some(person => person.middle)) {
      this.fit(people)
      this.fitted = true
    }
    if (this.mode.startsWith('person')) this.follow(people, FOLLOWS)
    this.lookThrough(this.cameraIndex()) // cameras move, too
  }

  follow(people, share) {
    const person = people.find(each => `person ${each.id}` === this.mode)
    if (!person?.middle) return
    const way = new Vector3(...person.middle).sub(this.controls.target).multiplyScalar(share)
    this.controls.target.add(way)
    this.camera.position.add(way)
    this.controls.update()
  }

  // See all people from behind the first camera, or from -x; `behind` and `above`: shares of the distance.
  fit(people, [behind, above] = [0.94, 0.34]) {
    const places = people.map(person => person.middle).filter(Boolean).map(place => new Vector3(...place))
    const target = new Vector3(0, 0, 1)
    if (places.length) target.set(0, 0, 0)
    places.forEach(place => target.addScaledVector(place, 1 / places.length))
    const spread = Math.max(0, ...places.map(place => place.distanceTo(target)))
    const distance = (NEAREST + 1.3 * spread) * Math.max(1, 1 / this.camera.aspect)
    this.controls.target.copy(target)
    this.camera.position.copy(target).addScaledVector(this.forward(), -behind * distance)
    this.camera.position.z += above * distance
    this.controls.update()
    this.changed()
  }

  // Horizontal direction of the first camera.
  forward() {
    const rotation = this.cameras[0]?.rotation
    const forward = rotation ? new Vector3(rotation[2], rotation[5], 0) : new Vector3()
    return forward.lengthSq() > 0.01 ? forward.normalize() : new Vector3(1, 0, 0)
  }

  lookThrough(index) {
    const seen = this.cameras.find(each => each.index === index)
    if (!seen) return
    const {rotation: r, size: [width, height], K: [, fy, cx, cy]} = seen
    // optical frames have y down and z forward, three.js y up and z backward
    this.camera.quaternion.setFromRotationMatrix(new Matrix4().set(
      r[0], -r[1], -r[2], 0, r[3], -r[4], -r[5], 0, r[6], -r[7], -r[8], 0, 0, 0, 0, 1))
    this.camera.position.set(...seen.position)
    const scale = Math.min(this.size[0] / width, this.size[1] / height)
    this.camera.fov = 2 * Math.atan(this.size[1] / scale / 2 / fy) * 180 / Math.PI
    this.camera.setViewOffset(...this.size, (width / 2 - cx) * scale, (height / 2 - cy) * scale, ...this.size)
  }

  // The camera that the view is from; -1: none.
  cameraIndex() {
    const [kind, which] = this.mode.split(' ')
    return kind === 'camera' ? Number(which) : -1
  }

  // Touching the view from a camera makes it free, from the same place.
  leaveCamera() {
    if (this.cameraIndex() < 0) return
    const ahead = new Vector3()
    this.camera.getWorldDirection(ahead)
    this.controls.target.copy(this.camera.position).addScaledVector(ahead, NEAREST)
    this.camera.clearViewOffset()
    this.camera.fov = ANGLE
    this.camera.updateProjectionMatrix()
    this.mode = 'free'
    this.fitted = true
    this.controls.enabled = true
    this.controls.update()
    this.changed()
  }

  distance(point) {
    return this.camera.position.distanceTo(new Vector3(...point))
  }

  // The pixel of a point [m], from the top left of the view; null behind it.
  project([x, y, z]) {
    const place = new Vector3(x, y, z).applyMatrix4(this.camera.matrixWorldInverse)
    if (place.z > -this.camera.near) return null
    place.applyMatrix4(this.camera.projectionMatrix)
    return [(place.x + 1) / 2 * this.size[0], (1 - place.y) / 2 * this.size[1]]
  }
}
