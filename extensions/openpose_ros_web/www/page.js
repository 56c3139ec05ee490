// Puts the page together: source -> state -> scene, table and image.
import {Menu} from './menu.js'
import {Panel} from './panel.js'
import {Picture} from './picture.js'
import {Player} from './player.js'
import {Scene} from './scene.js'
import {Settings} from './settings.js'
import {State} from './state.js'

const LOOK = 500 // [ms]
const STALE = 6 // people are faded after so many looks without a message between them

// `source` has start(state) and want(wish), and calls receive, receiveBinary and setLink of the state; one of a recording
// has recording and show(time), too.
export function openPage(source) {
  const state = new State(), settings = new Settings(), recorded = Boolean(source.recording)
  let wished = '', last = 0, quiet = 0
  const ask = () => {
    const wish = {image: document.hidden ? null : picture.wish()}
    if (!state.messages.hello || JSON.stringify(wish) === wished) return
    wished = JSON.stringify(wish)
    source.want(wish)
  }
  const setView = mode => {
    scene.view.setMode(mode, state.people())
    if (scene.view.cameraIndex() >= 0) picture.choose(scene.view.cameraIndex())
  }
  const panel = new Panel(state, id => setView(scene.view.mode === `person ${id}` ? 'free' : `person ${id}`))
  const drawn = (people, cameras) => {
    const {mode} = scene.view
    panel.showPeople(people, cameras.find(camera => camera.index === picture.camera()) ?? cameras[0], mode)
    menu.showViews(viewsOf(people, cameras, mode), mode)
    window.peopleView.messages = {...state.messages}
  }
  const menu = new Menu(settings, {
    setView,
    fit: () => { setView('free'); scene.view.fit(state.people()) },
    followNext: () => {
      const ids = state.people().map(person => person.id)
      const next = ids[(ids.findIndex(id => scene.view.mode === `person ${id}`) + 1) % ids.length]
      if (next !== undefined) setView(`person ${next}`)
    }})
  const picture = new Picture(state, settings, () => ask())
  document.body.classList.toggle('recorded', recorded)
  let scene
  try {
    scene = new Scene(document.getElementById('scene'), document.getElementById('labels'), state, settings, drawn)
  } catch (error) {
    notice([`No view in 3D, which needs WebGL: ${error.message}`])
    throw error
  }
  // for tests, and for those who look into the page
  window.peopleView = {messages: {}, state, settings, view: scene.view, joints: () => scene.joints()}
  state.on('hello', hello => {
    wished = ''
    document.body.classList.toggle('flat', hello.dimensions === 2)
    ask()
  })
  state.on('people', () => { [last, quiet] = [Date.now(), 0] })
  settings.onChange(ask)
  document.addEventListener('visibilitychange', ask)
  setInterval(() => {
    const {state: link, text} = state.link, old = last > 0 && ++quiet > STALE && !recorded
    const waiting = last === 0 && !recorded
    document.body.classList.toggle('old', old)
    document.body.classList.toggle('waiting', waiting)
    notice([link === 'lost' && text, link === 'live' && waiting && 'waiting for the first message', old && `last seen ${Math.round((Date.now() - last) / 1000)} s ago`])
  }, LOOK)
  source.start(state)
  if (recorded) window.peopleView.player = new Player(source)
}

function viewsOf(people, cameras, mode) {
  const ids = people.map(({id}) => `person ${id}`)
  if (mode.startsWith('person') && !ids.includes(mode)) ids.push(mode)
  return [['free', 'Free (0: all)'], ['above', 'From above (A)'], ...ids.map(id => [id, `Follow ${id.slice(7)} (F: next)`]),
    ...cameras.map(({index, name}) => [`camera ${index}`, `Camera ${name} (${index + 1})`])]
}

function notice(texts) {
  const place = document.getElementById('notice')
  place.textContent = texts.filter(Boolean).join('; ')
  place.hidden = !place.textContent
}
