// The table of a recording: a row per frame and person.
import {gestureText} from './words.js'

export function saveTable(recording) {
  const link = document.createElement('a')
  link.href = URL.createObjectURL(new Blob(tableOf(recording), {type: 'text/csv'}))
  link.download = `${recording.name.replace(/\.[^.]*$/, '').replace(/[^\w.-]+/g, '_')}.csv`
  link.click()
  setTimeout(() => URL.revokeObjectURL(link.href), 10000)
}

// Lines of the table; positions [m] as the page has them, z up, to the millimetre.
export function tableOf(recording) {
  const {joints} = recording.hello.skeletons[recording.messages(0)[1].skeleton]
  const columns = joints.flatMap(joint => ['x', 'y', 'z', 'status', 'sigma'].map(field => `${joint}.${field}`))
  const lines = [`${['time', 'person_ID', 'posture', 'fallen', 'gestures', 'speed', ...columns].join(',')}\n`]
  for (let frame = 0; frame < recording.frames; frame++) {
    const [signals, people] = recording.messages(frame)
    const known = new Map(signals.people.map(person => [person.id, person]))
    for (const person of people.people) lines.push(lineOf(people.stamp, person, known.get(person.id)))
  }
  return lines
}

function lineOf(stamp, {id, xyz, status, sigma}, signals) {
  const gestures = (signals?.gestures ?? []).map(gestureText).join('; ')
  const metres = value => value / 1000
  const cells = status.flatMap((state, joint) => state === 0 ? ['', '', '', 0, '']
    : [...xyz.slice(3 * joint, 3 * joint + 3).map(metres), state, sigma[joint] ? metres(sigma[joint]) : ''])
  return `${[stamp.toFixed(6), id, textCell(signals?.posture ?? ''), signals ? signals.fallen : '', textCell(gestures),
    signals?.speed ?? '', ...cells].join(',')}\n`
}

// Texts of messages are quoted where they must be, and are no formulas of a spreadsheet.
function textCell(text) {
  const harmless = /^[=+\-@\t\r]/.test(text) ? `'${text}` : text
  return /[",\r\n]/.test(harmless) ? `"${harmless.replace(/"/g, '""')}"` : harmless
}
