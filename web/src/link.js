// SPDX-License-Identifier: BSD-3-Clause
// The connection to the cell: it says what comes, since when nothing comes, and comes back.

const SILENT_MS = 2500;
const SHORTEST_MS = 500;
const LONGEST_MS = 8000;
const LOOK_MS = 500;

/** Receives; all it ever sends is how many messages have come. */
export class Link {
  /**
   * @param {string} address
   * @param {(message: string|ArrayBuffer) => void} onMessage
   * @param {() => void} onChange  of `lostAt`
   */
  constructor(address, onMessage, onChange) {
    this.address = address;
    this.onMessage = onMessage;
    this.onChange = onChange;
    /** When the last message came, as a time of day [ms]; null while all is well. */
    this.lostAt = /** @type {number|null} */ (null);
    /** Why the cell refuses; empty: it does not, or does not answer. */
    this.refusal = '';
    this.wait = SHORTEST_MS;
    this.lastAt = Date.now();
    this.silentSince = performance.now();
    this.socket = /** @type {WebSocket|null} */ (null);
    this.later = 0;
    addEventListener('online', () => this.again(0));
    document.addEventListener('visibilitychange', () => {
      if (!document.hidden && this.lostAt !== null) this.again(0);
    });
    setInterval(() => this.look(), LOOK_MS);
    this.open();
  }

  open() {
    const socket = new WebSocket(this.address);
    socket.binaryType = 'arraybuffer';
    let count = 0;
    let wasOpen = false;
    socket.addEventListener('open', () => {
      wasOpen = true;
      this.silentSince = performance.now();
    });
    socket.addEventListener('message', (event) => {
      if (socket !== this.socket) return;
      this.silentSince = performance.now();
      this.lastAt = Date.now();
      this.wait = SHORTEST_MS;
      socket.send(String(++count));
      if (this.lostAt !== null || this.refusal) {
        this.lostAt = null;
        this.refusal = '';
        this.onChange();
      }
      this.onMessage(event.data);
    });
    socket.addEventListener('close', () => {
      if (socket !== this.socket) return;
      this.socket = null;
      this.lose();
      if (!wasOpen) this.ask();
      this.again(this.wait * (0.8 + 0.4 * Math.random()));
      this.wait = Math.min(1.7 * this.wait, LONGEST_MS);
    });
    this.socket = socket;
  }

  /** @param {number} ms  until it is tried again */
  again(ms) {
    clearTimeout(this.later);
    this.later = setTimeout(() => {
      if (this.lostAt === null) return;
      this.drop();
      this.silentSince = performance.now();
      this.open();
    }, ms);
  }

  /** Connects to another address; what has come stays.  @param {string} address */
  move(address) {
    this.address = address;
    this.drop();
    this.silentSince = performance.now();
    this.open();
  }

  drop() {
    const {socket} = this;
    this.socket = null;
    socket?.close();
  }

  lose() {
    if (this.lostAt === null) this.lostAt = this.lastAt;
    this.onChange();
  }

  /** A connection without messages, or that does not come about, is dead: another one is tried. */
  look() {
    if (this.lostAt !== null) this.onChange();  // the time goes on
    if (performance.now() - this.silentSince < SILENT_MS || this.socket === null) return;
    this.drop();
    this.lose();
    this.again(0);
  }

  /** Browsers do not tell why a connection is refused. */
  async ask() {
    try {
      const answer = await fetch('why', {cache: 'no-store'});
      this.refusal = (await answer.text()).slice(0, 300);
    } catch {
      this.refusal = '';
    }
    this.onChange();
  }
}
