// What stands still around the people: floor and cameras.
import {BufferAttribute, BufferGeometry, Fog, LineBasicMaterial, LineSegments} from './vendor/three.module.min.js'
import {MISSING} from './state.js'
import {Rods} from './pool.js'

export const GROUND = 'rgb(22, 25, 31)'
const GRID = 0x4a5261, CAMERA = [150, 160, 175]
const SIDE = 20 // of the floor [m]
const DEPTH = 0.25 // of the cameras' frustums [m]
// A camera this high over z = 0 says that z = 0 is the floor [m]; otherwise the lowest joints tell.
const MOUNTED = 0.3

export class Scenery {
  constructor(parent) {
    this.parent = parent
    this.rods = new Rods(parent)
    this.grid = new LineSegments(squares(), new LineBasicMaterial({color: GRID}))
    parent.fog = new Fog(GROUND, 6, 14)
    parent.add(this.grid)
    this.reset()
  }

  reset() {
    this.floor = 0
    this.lowest = []
    this.stamp = null
  }

  // `behind`: the index of the camera that the view is from.
  draw(cameras, target, behind, settings) {
    this.grid.visible = settings.grid
    this.grid.position.set(Math.round(target.x), Math.round(target.y), this.floor)
    this.rods.clear()
    if (settings.cameras) cameras.filter(({index}) => index !== behind).forEach(camera => this.drawFrustum(camera))
    this.rods.show()
  }

  // `stamp` of the people: a frame that is drawn again says nothing new.
  findFloor(people, stamp, cameras) {
    if (cameras.some(camera => camera.position[2] > MOUNTED)) {
      this.floor = 0
      return
    }
    if (stamp === this.stamp) return
    this.stamp = stamp
    for (const {points, status} of people) {
      const heights = points.filter((_, joint) => status[joint] !== MISSING).map(point => point[2])
      if (heights.length) this.lowest.push(Math.min(...heights))
    }
    this.lowest = this.lowest.slice(-300)
    if (this.lowest.length) this.floor = [...this.lowest].sort((a, b) => a - b)[Math.floor(this.lowest.length / 10)]
  }

  drawFrustum({position, rotation: r, size: [width, height], K: [fx, fy, cx, cy]}) {
    const corners = [[0, 0], [width, 0], [width, height], [0, height]].map(([u, v]) => {
      const ray = [DEPTH * (u - cx) / fx, DEPTH * (v - cy) / fy, DEPTH]
      return position.map((value, axis) =>
        value + r[3 * axis] * ray[0] + r[3 * axis + 1] * ray[1] + r[3 * axis + 2] * ray[2])
    })
    corners.forEach((corner, index) => {
      this.rods.add(position, corner, 0.004, CAMERA)
      this.rods.add(corner, corners[(index + 1) % 4], 0.004, CAMERA)
    })
  }
}

// Lines of a square's length, as browsers without a graphics card lose longer ones that end behind the view.
function squares() {
  const places = []
  for (let line = -SIDE / 2; line <= SIDE / 2; line++) {
    for (let start = -SIDE / 2; start < SIDE / 2; start++) {
      places.push(line, start, 0, line, start + 1, 0, start, line, 0, start + 1, line, 0)
    }
  }
  return new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(places), 3))
}
