// Skeletons, hands and faces as in RViz: MEASURED solid, INFERRED pale and dashed; sigma as a halo.
import {INFERRED, MEASURED, MISSING} from './state.js'
import {Rods, Spheres} from './pool.js'

const HALO = [255, 220, 0]

export class Bodies {
  constructor(parent, look) {
    this.look = look
    const {opacity} = look
    this.joints = {[MEASURED]: new Spheres(parent, opacity.joint), [INFERRED]: new Spheres(parent, opacity.joint_inferred)}
    this.limbs = {[MEASURED]: new Rods(parent, opacity.skeleton), [INFERRED]: new Rods(parent, opacity.skeleton_inferred)}
    this.landmarks = {[MEASURED]: new Rods(parent), [INFERRED]: new Rods(parent, opacity.skeleton_inferred)}
    this.halos = new Spheres(parent, opacity.sigma)
    this.all = [this.joints, this.limbs, this.landmarks].flatMap(each => Object.values(each)).concat(this.halos)
  }

  draw(people, hands, faces, settings) {
    this.all.forEach(pool => pool.clear())
    for (const person of people) {
      this.drawLimbs(person, this.limbs, this.look.limb_width)
      person.points.forEach((point, joint) => {
        const status = person.status[joint]
        if (status === MISSING) return
        this.joints[status].add(point, this.look.joint_diameter / 2, colourOf(person.rgb, status, this.look))
        if (settings.sigma && person.sigma[joint] > 0) this.halos.add(point, person.sigma[joint], HALO)
      })
    }
    for (const each of [...settings.hands ? hands : [], ...settings.faces ? faces : []]) {
      this.drawLimbs(each, this.landmarks, this.look.landmark_width)
    }
    this.all.forEach(pool => pool.show())
  }

  drawLimbs({points, status, limbs, rgb}, pools, width) {
    for (const [start, end] of limbs) {
      if (status[start] === MISSING || status[end] === MISSING) continue
      const known = status[start] === MEASURED && status[end] === MEASURED ? MEASURED : INFERRED
      const colour = colourOf(rgb, known, this.look)
      if (known === MEASURED) pools[known].add(points[start], points[end], width / 2, colour)
      else pools[known].addDashed(points[start], points[end], width / 2, colour, this.look.dash_length)
    }
  }
}

// INFERRED parts are mixed with white, as in RViz.
function colourOf(rgb, status, look) {
  return status === MEASURED ? rgb : rgb.map(value => value + look.inferred_white * (255 - value))
}
