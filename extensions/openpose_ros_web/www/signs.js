// What people do: velocities, pointing rays, and their paths of the last seconds.
import {metres} from './state.js'
import {Rods, Spheres} from './pool.js'

const SLOWEST = 0.15 // slower people have no arrow [m/s]
const RAY = 4 // length of a pointing ray that hits nothing [m]
const TRAIL = 8 // [s]
const TRAIL_STEP = 0.08 // distance of a trail's points [m]
const FLOATS = 0.012 // height of trails over the floor [m]

export class Signs {
  constructor(parent) {
    this.rods = new Rods(parent)
    this.tips = new Rods(parent, 1, 0)
    this.rays = new Rods(parent, 0.75)
    this.spots = new Spheres(parent, 0.75)
    this.trails = new Rods(parent)
    this.all = [this.rods, this.tips, this.rays, this.spots, this.trails]
    this.paths = new Map()
    this.stamp = -Infinity
  }

  // `stamp` [s] of the people, `floor` its height [m].
  draw(people, stamp, floor, settings, theme) {
    this.all.forEach(pool => pool.clear())
    this.remember(people, stamp)
    for (const person of people) {
      if (settings.velocity && person.velocity && person.middle) this.drawVelocity(person, theme)
      if (settings.pointing) this.drawPointing(person, theme)
    }
    if (settings.trails) this.drawTrails(stamp, floor, theme)
    this.all.forEach(pool => pool.show())
  }

  // An arrow with the length of half a second's way.
  drawVelocity({middle, velocity, rgb}, theme) {
    if (Math.hypot(...velocity) < SLOWEST) return
    const end = share => middle.map((value, axis) => value + share * velocity[axis])
    this.rods.add(middle, end(0.5), 0.012, theme.shade(rgb))
    this.tips.add(end(0.5), end(0.62), 0.035, theme.shade(rgb))
  }

  drawPointing({signals, rgb}, theme) {
    for (const {pointing} of signals?.gestures ?? []) {
      if (!pointing?.origin || !pointing.direction) continue
      const origin = metres(pointing.origin)
      const end = pointing.hit ? metres(pointing.hit)
        : origin.map((value, axis) => value + RAY * pointing.direction[axis])
      this.rays.addDashed(origin, end, 0.01, theme.shade(rgb), 0.12)
      if (pointing.hit) this.spots.add(end, 0.07, theme.shade(rgb))
    }
  }

  remember(people, stamp) {
    if (stamp < this.stamp) this.paths.clear()
    this.stamp = stamp
    for (const {id, rgb, middle} of people) {
      if (!middle) continue
      const path = this.paths.get(id) ?? {rgb, points: []}
      const last = path.points[path.points.length - 1]
      if (!last || Math.hypot(middle[0] - last.x, middle[1] - last.y) > TRAIL_STEP) {
        path.points.push({x: middle[0], y: middle[1], stamp})
      }
      this.paths.set(id, path)
    }
    for (const [id, path] of this.paths) {
      path.points = path.points.filter(point => stamp - point.stamp < TRAIL)
      if (!path.points.length) this.paths.delete(id)
    }
  }

  drawTrails(stamp, floor, theme) {
    for (const {rgb, points} of this.paths.values()) {
      points.slice(1).forEach((point, index) => {
        const before = points[index]
        const left = Math.max(1 - (stamp - point.stamp) / TRAIL, 0)
        const colour = theme.shade(rgb).map((value, axis) => theme.ground[axis] + left * (value - theme.ground[axis]))
        const height = floor + FLOATS
        if (point.stamp - before.stamp < 2) {
          this.trails.add([before.x, before.y, height], [point.x, point.y, height], 0.006 + 0.014 * left, colour)
        }
      })
    }
  }
}
