// The page of a recording that is within it.
import {openPage} from './page.js'
import {Player} from './player.js'
import {RecordedSource, readRecording} from './recording.js'

readRecording().then(recording => {
  document.body.classList.add('recorded')
  const source = new RecordedSource(recording)
  openPage(source)
  window.peopleView.player = new Player(recording, source)
}, error => { document.getElementById('link').textContent = `the recording is damaged: ${error.message}` })
