// The stream of youbotd by Foxglove's WebSocket protocol: https://github.com/foxglove/ws-protocol
const kProtocols = ['foxglove.sdk.v1', 'foxglove.websocket.v1'];
const kRetry_ms = 1000;
const kMessageData = 1;
const kHead_bytes = 13;  // kind, subscription, time
const kCdrHead_bytes = 4;

let session = null;

// `topics`: {name: listener(time_s, DataView of the payload)}. `changed(connected)`.
export function connect(topics, changed) {
  const address = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
  const listeners = [];
  const socket = new WebSocket(address, kProtocols);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = ({data}) => {
    if (typeof data === 'string') {
      const message = JSON.parse(data);
      if (message.op === 'serverInfo') {
        // Another start of youbotd may have other joints and columns.
        if (session && session !== message.sessionId) location.reload();
        session = message.sessionId;
      }
      if (message.op !== 'advertise') return;
      const subscriptions = message.channels.filter(channel => topics[channel.topic])
        .map(channel => ({id: listeners.push(topics[channel.topic]) - 1, channelId: channel.id}));
      socket.send(JSON.stringify({op: 'subscribe', subscriptions}));
      changed(true);
      return;
    }
    const view = new DataView(data);
    if (view.getUint8(0) !== kMessageData) return;
    listeners[view.getUint32(1, true)]?.(Number(view.getBigUint64(5, true)) * 1e-9, new DataView(data, kHead_bytes));
  };
  socket.onclose = () => {
    changed(false);
    setTimeout(() => connect(topics, changed), kRetry_ms);
  };
}

export function json(payload) {
  return JSON.parse(new TextDecoder().decode(payload));
}

// A message of float64 only.
export function numbers(payload, count) {
  const values = new Float64Array(count);
  for (let i = 0; i < count; ++i) values[i] = payload.getFloat64(kCdrHead_bytes + 8 * i, true);
  return values;
}
