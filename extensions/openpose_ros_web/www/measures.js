// Rate of people, and time from the camera's stamp until a frame is drawn.
const SPAN = 2000 // [ms]
// The page's clock is the node's on the same computer; elsewhere the fastest message tells the difference.
const SAME_CLOCK = ['localhost', '127.0.0.1', '[::1]'].includes(location.hostname)

export class Measures {
  constructor(state) {
    this.arrivals = []
    this.latencies = []
    this.offset = SAME_CLOCK ? 0 : Infinity
    state.on('hello', () => { this.offset = SAME_CLOCK ? 0 : Infinity })
    state.on('people', people => this.arrived(people))
  }

  arrived(people) {
    const now = Date.now()
    if (!SAME_CLOCK) this.offset = Math.min(this.offset, now / 1000 - people.time)
    this.arrivals.push(now)
    this.arrivals = this.arrivals.filter(time => now - time < SPAN)
  }

  // A message of people is on the screen.
  shown(people) {
    if (!people || people === this.last) return
    this.last = people
    this.latencies.push(people.age + Date.now() / 1000 - this.offset - people.time)
    this.latencies = this.latencies.slice(-60)
  }

  values() {
    const recent = this.arrivals.filter(time => Date.now() - time < SPAN)
    const sorted = [...this.latencies].sort((a, b) => a - b)
    return {rate: recent.length * 1000 / SPAN, latency: recent.length ? sorted[sorted.length >> 1] ?? null : null}
  }
}
