// The page of a running node.
import {LiveSource} from './live.js'
import {openPage} from './page.js'

openPage(new LiveSource(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`))
