const socket = new WebSocket(`ws://${location.host}/ws`)
socket.onmessage = ({data}) => {
  const message = JSON.parse(data)
  if (message.type === 'people') document.getElementById('people').textContent = JSON.stringify(message, null, 1)
}
