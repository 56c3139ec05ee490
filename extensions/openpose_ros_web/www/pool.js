// Many shapes of one kind in one draw call, set anew for each frame.
import {Color, CylinderGeometry, InstancedMesh, Matrix4, MeshLambertMaterial, Quaternion, SphereGeometry, Vector3}
  from './vendor/three.module.min.js'

const UP = new Vector3(0, 1, 0)

class Pool {
  constructor(parent, geometry, opacity) {
    this.parent = parent
    this.geometry = geometry
    this.material = new MeshLambertMaterial({transparent: opacity < 1, opacity, depthWrite: opacity > 0.4, fog: false})
    this.count = 0
    this.matrix = new Matrix4()
    this.colour = new Color()
    this.grow(256)
  }

  grow(size) {
    const before = this.mesh
    this.mesh = new InstancedMesh(this.geometry, this.material, size)
    this.mesh.frustumCulled = false
    this.mesh.visible = false // until `show`: instances begin at the origin with the size of the geometry
    this.mesh.setColorAt(0, this.colour)
    if (before) {
      this.mesh.instanceMatrix.array.set(before.instanceMatrix.array)
      this.mesh.instanceColor.array.set(before.instanceColor.array)
    }
    before?.removeFromParent()
    before?.dispose()
    this.parent.add(this.mesh)
  }

  clear() {
    this.count = 0
  }

  put(rgb) {
    if (this.count === this.mesh.instanceMatrix.count) this.grow(2 * this.count)
    this.mesh.setMatrixAt(this.count, this.matrix)
    this.mesh.setColorAt(this.count, this.colour.setRGB(rgb[0] / 255, rgb[1] / 255, rgb[2] / 255))
    this.count += 1
  }

  // Show what was put since it was cleared.
  show() {
    this.mesh.count = this.count
    this.mesh.visible = this.count > 0
    this.mesh.instanceMatrix.needsUpdate = true
    this.mesh.instanceColor.needsUpdate = true
  }
}

export class Spheres extends Pool {
  constructor(parent, opacity = 1) {
    super(parent, new SphereGeometry(1, 16, 12), opacity)
  }

  add([x, y, z], radius, rgb) {
    this.matrix.makeScale(radius, radius, radius).setPosition(x, y, z)
    this.put(rgb)
  }
}

export class Rods extends Pool {
  // `tip`: radius at the end, as a share of that at the start.
  constructor(parent, opacity = 1, tip = 1) {
    super(parent, new CylinderGeometry(tip, 1, 1, 8), opacity)
    this.place = [new Vector3(), new Quaternion(), new Vector3()]
  }

  add(start, end, radius, rgb) {
    const [middle, turn, scale] = this.place
    scale.set(end[0] - start[0], end[1] - start[1], end[2] - start[2])
    const length = scale.length()
    if (length < 1e-6) return
    turn.setFromUnitVectors(UP, scale.divideScalar(length))
    middle.set(start[0] + end[0], start[1] + end[1], start[2] + end[2]).multiplyScalar(0.5)
    this.matrix.compose(middle, turn, scale.set(radius, length, radius))
    this.put(rgb)
  }

  // Dashes and gaps of a length, fitted to the line.
  addDashed(start, end, radius, rgb, dash) {
    const length = Math.hypot(...end.map((value, axis) => value - start[axis]))
    const pieces = dash > 0 ? Math.min(Math.max(Math.round((length / dash - 1) / 2), 0), 100) : 0
    const at = share => start.map((value, axis) => value + share * (end[axis] - value))
    for (let piece = 0; piece <= pieces; piece++) {
      this.add(at(2 * piece / (2 * pieces + 1)), at((2 * piece + 1) / (2 * pieces + 1)), radius, rgb)
    }
  }
}
