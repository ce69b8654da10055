// The stop button: works before, and without, everything else of the page.
const kPatience_ms = 1000;

function complain(message) {
  const line = document.getElementById('message');
  line.textContent = message;
  line.hidden = message === '';
}

async function stop() {
  complain('stopping');
  try {
    const response = await fetch('stop', {method: 'POST', signal: AbortSignal.timeout(kPatience_ms)});
    complain(response.ok ? '' : `The stop was refused: ${await response.text()}`);
  } catch {
    complain('The stop did not reach youbotd. Use the emergency stop.');
  }
}

document.getElementById('stop').addEventListener('click', stop);
addEventListener('keydown', event => { if (event.key === 'Escape') document.getElementById('stop').click(); });
