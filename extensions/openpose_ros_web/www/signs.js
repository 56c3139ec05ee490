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
    this.paths = new Map() // by id: {rgb, points}
  }

  // `stamp` [s] of the people, `floor` its height [m].
  draw(people, stamp, floor, settings, theme) {
    this.all.forEach(pool => pool.clear())
    this.remember(people, stamp)
    if (settings.trails) this.drawTrails(stamp, floor + FLOATS, theme)
    for (const {middle, velocity, rgb, signals} of people) {
      const colour = theme.shade(rgb)
      if (settings.velocity && velocity && middle) this.drawVelocity(middle, velocity, colour)
      const gestures = settings.pointing ? signals?.gestures ?? [] : []
      for (const {pointing} of gestures) if (pointing?.origin && pointing.direction) this.drawPointing(pointing, colour)
    }
    this.all.forEach(pool => pool.show())
  }

  // An arrow with the length of half a second's way.
  drawVelocity(middle, velocity, colour) {
    if (Math.hypot(...velocity) < SLOWEST) return
    const end = share => middle.map((value, axis) => value + share * velocity[axis])
    this.rods.add(middle, end(0.5), 0.012, colour)
    this.tips.add(end(0.5), end(0.62), 0.035, colour)
  }

  drawPointing({origin, direction, hit}, colour) {
    const start = metres(origin), end = hit ? metres(hit) : start.map((value, axis) => value + RAY * direction[axis])
    this.rays.addDashed(start, end, 0.01, colour, 0.12)
    if (hit) this.spots.add(end, 0.07, colour)
  }
  remember(people, stamp) {
    if (stamp < this.stamp) this.paths.clear()
    this.stamp = stamp
    for (const {id, rgb, middle} of people) {
      if (!middle) continue
      const [x, y] = middle, {points} = this.paths.get(id) ?? {points: []}, last = points[points.length - 1]
      if (!last || Math.hypot(x - last.x, y - last.y) > TRAIL_STEP) points.push({x, y, stamp})
      this.paths.set(id, {rgb, points})
    }
    for (const [id, {points}] of this.paths) {
      while (points.length && stamp - points[0].stamp >= TRAIL) points.shift()
      if (!points.length) this.paths.delete(id)
    }
  }

  // Trails become thin and pale with time.
  drawTrails(stamp, height, theme) {
    for (const {rgb, points} of this.paths.values()) {
      points.slice(1).forEach((point, index) => {
        const before = points[index], left = 1 - (stamp - point.stamp) / TRAIL
        if (point.stamp - before.stamp >= 2) return
        const colour = theme.shade(rgb).map((value, axis) => theme.ground[axis] + left * (value - theme.ground[axis]))
        this.trails.add([before.x, before.y, height], [point.x, point.y, height], 0.006 + 0.014 * left, colour)
      })
    }
  }
}
