// The recording in the page: compressed lines of JSON. The first one tells what is in it, each other one has the
// messages of a frame.
const GAP = 1 // people are there until the next frame, but not longer [s]

export async function readRecording() {
  const packed = bytesOf(document.getElementById('recording').textContent)
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'))
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer())
  const ends = []
  for (let end = bytes.indexOf(10); end >= 0; end = bytes.indexOf(10, end + 1)) ends.push(end)
  const reader = new TextDecoder()
  const line = number => JSON.parse(reader.decode(bytes.subarray(number ? ends[number - 1] + 1 : 0, ends[number])))
  return {...line(0), frames: ends.length - 1, messages: index => line(index + 1)}
}

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length)
  for (let index = 0; index < text.length; index++) bytes[index] = text.charCodeAt(index)
  return bytes
}

// Number of the last time that is not after `time`; -1: none is.
export function lastBefore(times, time) {
  let low = 0, high = times.length
  while (low < high) {
    const middle = (low + high) >> 1
    if (times[middle] <= time) low = middle + 1
    else high = middle
  }
  return low - 1
}

export class RecordedSource {
  constructor(recording) {
    this.recording = recording
    this.imageTimes = recording.images.map(([time]) => time)
    this.shown = null
    this.image = -1
  }

  start(state) {
    this.state = state
    state.setLink('recorded', `${this.recording.name}, ${this.recording.moment}`)
    state.receive(this.recording.hello)
    state.receive(this.recording.cameras)
    this.show(0)
  }

  want() {}

  // Show the frame of a time [s] since the first one, and the image before it.
  show(time) {
    const {stamps, images, messages} = this.recording
    const index = Math.max(lastBefore(stamps, time), 0), gone = time - stamps[index] > GAP
    if (this.shown !== `${index} ${gone}`) {
      this.shown = `${index} ${gone}`
      for (const message of messages(index)) this.state.receive(gone ? {...message, people: [], hands: [], faces: []} : message)
    }
    const image = lastBefore(this.imageTimes, time + 1e-3)
    if (image >= 0 && image !== this.image) this.state.receiveBinary(bytesOf(images[image][1]).buffer)
    this.image = image
  }
}
