// What people do: velocities and pointing rays.
import {metres} from './state.js'
import {Rods, Spheres} from './pool.js'

const SLOWEST = 0.15 // slower people have no arrow [m/s]
const RAY = 4 // length of a pointing ray that hits nothing [m]

export class Signs {
  constructor(parent) {
    this.rods = new Rods(parent)
    this.tips = new Rods(parent, 1, 0)
    this.rays = new Rods(parent, 0.75)
    this.spots = new Spheres(parent, 0.75)
    this.all = [this.rods, this.tips, this.rays, this.spots]
  }

  draw(people, settings) {
    this.all.forEach(pool => pool.clear())
    for (const {middle, velocity, rgb, signals} of people) {
      if (settings.velocity && velocity && middle) this.drawVelocity(middle, velocity, rgb)
      const gestures = settings.pointing ? signals?.gestures ?? [] : []
      for (const {pointing} of gestures) if (pointing?.origin && pointing.direction) this.drawPointing(pointing, rgb)
    }
    this.all.forEach(pool => pool.show())
  }

  // An arrow with the length of half a second's way.
  drawVelocity(middle, velocity, rgb) {
    if (Math.hypot(...velocity) < SLOWEST) return
    const end = share => middle.map((value, axis) => value + share * velocity[axis])
    this.rods.add(middle, end(0.5), 0.012, rgb)
    this.tips.add(end(0.5), end(0.62), 0.035, rgb)
  }

  drawPointing({origin, direction, hit}, rgb) {
    const start = metres(origin), end = hit ? metres(hit) : start.map((value, axis) => value + RAY * direction[axis])
    this.rays.addDashed(start, end, 0.01, rgb, 0.12)
    if (hit) this.spots.add(end, 0.07, rgb)
  }
}
