// The stop button: works before, and without, everything else of the page.
const kPatience_ms = 1000;

function complain(message) {
  const line = document.getElementById('message');
  line.textContent = message;
  line.hidden = message === '';
}

// The request is not given up: it may still arrive.
async function stop() {
  complain('stopping');
  const late = setTimeout(() => complain('youbotd has not confirmed the stop. Use the emergency stop.'), kPatience_ms);
  try {
    const response = await fetch('stop', {method: 'POST'});
    complain(response.ok ? '' : `The stop was refused: ${await response.text()}`);
  } catch {
    complain('The stop did not reach youbotd. Use the emergency stop.');
  }
  clearTimeout(late);
}

document.getElementById('stop').addEventListener('click', stop);
addEventListener('keydown', event => {
  if (event.key === 'Escape' && !event.repeat) document.getElementById('stop').click();
});
