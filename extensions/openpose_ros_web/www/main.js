// The page: of the recording that is in it, or of the running node that serves it.
import {LiveSource} from './live.js'
import {openPage} from './page.js'
import {RecordedSource, readRecording} from './recording.js'

if (document.getElementById('recording')) {
  readRecording().then(recording => openPage(new RecordedSource(recording)),
    error => { document.getElementById('link').textContent = `the recording is damaged: ${error.message}` })
} else {
  openPage(new LiveSource(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`))
}
