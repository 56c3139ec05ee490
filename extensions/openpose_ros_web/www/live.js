// Messages of a running node, by WebSocket; connects again by itself.
const VERSION = 1
const FIRST_WAIT = 500, LONGEST_WAIT = 4000 // [ms]
// The node sends `state` each second: after so many looks, one each second, without a message between them the network
// or the computer is gone. A page that is busy looks less often, and its messages wait for it: time would tell nothing.
const SILENCE = 6

export class LiveSource {
  constructor(address) {
    this.address = address
    this.wish = {}
    this.wait = FIRST_WAIT
  }

  start(state) {
    this.state = state
    this.connect()
    // a browser that was asleep waits no longer
    addEventListener('online', () => this.connect())
    setInterval(() => this.watch(), 1000)
  }

  // Ask for an image: {image: {camera, width, rate}}.
  want(wish) {
    this.wish = wish
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({want: wish}))
  }

  connect() {
    if (this.socket && this.socket.readyState <= WebSocket.OPEN) return
    clearTimeout(this.timer)
    const socket = new WebSocket(this.address)
    socket.binaryType = 'arraybuffer'
    socket.onopen = () => this.want(this.wish)
    socket.onmessage = ({data}) => this.receive(data)
    // an old one may end late
    socket.onclose = () => { if (socket === this.socket) this.lost() }
    this.socket = socket
    this.quiet = 0
  }

  receive(data) {
    this.quiet = 0
    if (typeof data !== 'string') return this.state.receiveBinary(data)
    const message = JSON.parse(data)
    if (message.type === 'hello') {
      this.wait = FIRST_WAIT
      const same = message.version === VERSION
      this.state.setLink(same ? 'live' : 'other', same ? 'connected' : 'another version: load the page again')
    }
    this.state.receive(message)
  }

  // A browser that sends nothing never learns by itself that the other side is gone.
  watch() {
    if (!this.socket || this.socket.readyState > WebSocket.OPEN || ++this.quiet < SILENCE) return
    this.socket.close()
    this.socket = null
    this.lost()
  }

  lost() {
    this.state.setLink('lost', 'no connection, trying again')
    this.timer = setTimeout(() => this.connect(), this.wait)
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT)
  }
}
