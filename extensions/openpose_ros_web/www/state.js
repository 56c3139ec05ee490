// The newest message of each type, and those that listen to them. docs/web.md describes the messages.
export const MISSING = 0, MEASURED = 1, INFERRED = 2
const IMAGE = 1
// Signals, hands and faces belong to people in the same frame whose stamp is within this [s].
const TOGETHER = 0.5

export class State {
  constructor() {
    this.messages = {}
    this.link = {state: 'connecting', text: 'connecting'}
    this.listeners = new Map()
  }

  // Kinds: the types of messages, 'image' and 'link'.
  on(kind, listener) {
    this.listeners.set(kind, [...this.listeners.get(kind) ?? [], listener])
  }

  receive(message) {
    if (message.type === 'hello') this.messages = {}
    this.messages[message.type] = message
    this.tell(message.type, message)
  }

  receiveBinary(buffer) {
    const bytes = new DataView(buffer)
    if (bytes.getUint8(0) !== IMAGE) return
    this.tell('image', {camera: bytes.getUint8(1), stamp: bytes.getFloat64(8, true), jpeg: new Uint8Array(buffer, 16)})
  }

  setLink(state, text) {
    this.link = {state, text}
    this.tell('link', this.link)
  }

  tell(kind, value) {
    for (const listener of this.listeners.get(kind) ?? []) listener(value)
  }

  // The people of the newest message: id, rgb, joints, with their signals; see `personOf`.
  people() {
    const {hello, people, signals} = this.messages
    if (!hello || !people) return []
    const known = new Map(this.fresh('signals') ? signals.people.map(person => [person.id, person]) : [])
    const skeleton = hello.skeletons[people.skeleton]
    return people.people.map(person => personOf(person, skeleton, known.get(person.id)))
  }

  // Hands or faces with points and limbs, of people that are there.
  landmarks(type) {
    const {hello, people} = this.messages
    if (!this.fresh(type)) return []
    const colours = new Map(people.people.map(person => [person.id, person.rgb]))
    return this.messages[type][type].filter(each => colours.has(each.id)).map(each => ({
      id: each.id, rgb: colours.get(each.id), points: pointsOf(each.xyz), status: each.status,
      limbs: hello.skeletons[type === 'hands' ? 'HAND_21' : 'FACE_70'].limbs}))
  }

  fresh(type) {
    const message = this.messages[type], people = this.messages.people
    return Boolean(message && people && this.messages.hello && message.frame === people.frame
      && Math.abs(message.stamp - people.stamp) < TOGETHER)
  }
}

function personOf(person, skeleton, signals) {
  const points = pointsOf(person.xyz)
  return {
    id: person.id, rgb: person.rgb, points, status: person.status, limbs: skeleton.limbs, names: skeleton.joints,
    sigma: person.sigma.map(value => value / 1000), velocity: person.velocity?.map(value => value / 1000),
    signals, middle: middleOf(points, person.status, skeleton.joints), top: topOf(points, person.status)}
}

// Flat whole millimetres as points [m].
function pointsOf(flat) {
  return Array.from({length: flat.length / 3}, (_, row) => metres(flat.slice(3 * row, 3 * row + 3)))
}

export function metres(millimetres) {
  return millimetres.map(value => value / 1000)
}

// The middle of the hips, of the shoulders without them, else of all joints; null without joints.
function middleOf(points, status, names) {
  const known = wanted => points.filter((_, joint) => status[joint] !== MISSING && wanted(names[joint]))
  const hips = known(name => name.endsWith('hip'))
  const chosen = [hips, known(name => name.endsWith('shoulder') || name === 'neck'), known(() => true)]
    .find(each => each.length)
  return chosen ? [0, 1, 2].map(axis => chosen.reduce((sum, point) => sum + point[axis], 0) / chosen.length) : null
}

function topOf(points, status) {
  return points.reduce((top, point, joint) =>
    status[joint] !== MISSING && (top === null || point[2] > top) ? point[2] : top, null)
}
