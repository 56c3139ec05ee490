// What people did over time, images and plots, on one time axis; a click goes to its time.
import {make} from './menu.js'
import {spaced} from './words.js'

// Light for postures, strong for gestures: Okabe and Ito, "Color Universal Design", 2008; ColorBrewer's "Paired".
const POSTURES = ['#a6cee3', '#b2df8a', '#fdbf6f', '#cab2d6', '#fb9a99', '#ffff99']
const GESTURES = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#56b4e9', '#e69f00', '#882255']
const LANES = {left: [2, 26], right: [28, 26], both: [2, 52], posture: [56, 30], walking: [90, 8]} // top, height [%]
const IMAGES = 10

export class Timeline {
  // `seek` is called with a time [s]; `end`: of the recording [s].
  constructor(parent, recording, end, seek) {
    this.end = end
    this.seek = seek
    this.axis = recording.axis
    this.colours = new Map()
    this.heads = []
    parent.style.setProperty('--left', `${100 * this.axis[0]}%`)
    parent.style.setProperty('--width', `${100 * (this.axis[1] - this.axis[0])}%`)
    if (recording.images.length) parent.append(this.strip(recording.images))
    parent.append(...recording.persons.map(person => this.row(person, recording)), this.legend())
    parent.append(...recording.plots.map((plot, index) => this.plot(plot, index === 0)))
  }

  showTime(time) {
    this.heads.forEach(head => { head.style.left = `${100 * time / this.end}%` })
  }

  // A track with the time axis; `title`: left of it.
  track(title, name) {
    const row = make('div', {className: `row ${name}`}), track = make('div', {className: 'track'})
    const head = make('div', {className: 'head'})
    this.heads.push(head)
    track.append(head)
    track.onclick = event => {
      const {left, width} = track.getBoundingClientRect()
      this.seek(this.end * (event.clientX - left) / width)
    }
    row.append(title, track)
    return {row, track}
  }

  row({id, rgb}, {spans, falls}) {
    const name = make('strong', {textContent: String(id)})
    name.style.borderColor = `rgb(${rgb.join(' ')})`
    const {row, track} = this.track(name, 'person')
    row.setAttribute('aria-label', `Person ${id}`)
    track.prepend(...spans.filter(span => span.person === id && !(span.kind === 'posture' && span.name === 'unknown'))
      .map(span => this.span(span)))
    track.append(...falls.filter(([person]) => person === id).map(([, time]) => {
      const fall = make('span', {textContent: '▼', className: 'fall', title: 'fall'})
      fall.style.left = `${100 * time / this.end}%`
      return fall
    }))
    return row
  }

  span({kind, name, arm, begin, end}) {
    const [top, height] = LANES[kind === 'gesture' ? arm : kind] ?? LANES.both
    const text = kind === 'walking' ? 'walking' : spaced(name)
    const bar = make('span', {textContent: kind === 'walking' ? '' : text, className: kind,
      title: arm && arm !== 'both' ? `${text} (${arm})` : text})
    const from = Math.max(begin, 0), width = 100 * (Math.min(end, this.end) - from) / this.end
    Object.assign(bar.style, {left: `${100 * from / this.end}%`, width: `${Math.max(width, 0)}%`, top: `${top}%`,
      height: `${height}%`, backgroundColor: kind === 'walking' ? '' : this.colour(kind, text)})
    return bar
  }

  colour(kind, text) {
    const key = `${kind} ${text}`, palette = kind === 'posture' ? POSTURES : GESTURES
    if (!this.colours.has(key)) {
      const others = [...this.colours.keys()].filter(each => each.startsWith(`${kind} `)).length
      this.colours.set(key, {text, colour: palette[others % palette.length]})
    }
    return this.colours.get(key).colour
  }

  legend() {
    const legend = make('p', {className: 'legend'})
    legend.append(...[...this.colours.values()].map(({text, colour}) => {
      const entry = make('span', {textContent: text})
      entry.style.borderColor = colour
      return entry
    }))
    return legend
  }

  // Some of the images, where they were taken.
  strip(images) {
    const {row, track} = this.track(make('span'), 'strip')
    const shown = Math.min(IMAGES, images.length)
    for (let place = 0; place < shown; place++) {
      const time = (place + 0.5) / shown * this.end
      const [taken, message] = images.reduce((best, each) => Math.abs(each[0] - time) < Math.abs(best[0] - time) ? each : best)
      track.append(make('img', {alt: `Image at ${taken.toFixed(1)} s`,
        src: `data:image/jpeg;base64,${btoa(atob(message).slice(16))}`}))
    }
    return row
  }

  plot({title, svg}, open) {
    const plot = make('details', {className: 'plot', open}), image = make('img', {alt: title})
    plot.ontoggle = () => { // drawn when it is opened
      if (plot.open && !image.src) image.src = URL.createObjectURL(new Blob([svg], {type: 'image/svg+xml'}))
    }
    const {row} = this.track(image, 'drawn')
    plot.append(make('summary', {textContent: title}), row)
    return plot
  }
}
