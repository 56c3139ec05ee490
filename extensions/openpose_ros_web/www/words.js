// Messages in words.
export function postureText({posture, fallen}) {
  if (fallen) return 'fallen'
  return posture === 'unknown' ? '' : spaced(posture)
}

export function gestureText({name, arm, pointing}) {
  const side = arm && arm !== 'both' ? ` (${arm})` : ''
  return spaced(name) + (pointing?.target ? ` at ${pointing.target}` : side)
}

export function spaced(name) {
  return name.replace(/_/g, ' ').toLowerCase()
}
