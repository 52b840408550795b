// SPDX-License-Identifier: BSD-3-Clause
// The connection to the cell: passes on messages, reports silence, and reconnects.

const SILENT_MS = 2500;
const SHORTEST_MS = 500;
const LONGEST_MS = 8000;
const LOOK_MS = 500;

/** Receives messages; the only thing it sends is the number of received messages. */
export class Link {
  /**
   * @param {string} address
   * @param {(message: string|ArrayBuffer) => void} onMessage
   * @param {() => void} onChange  called when `lostAt` or `refusal` changes
   */
  constructor(address, onMessage, onChange) {
    this.address = address;
    this.onMessage = onMessage;
    this.onChange = onChange;
    /** Time of the last message [ms since the epoch]; null while connected. */
    this.lostAt = /** @type {number|null} */ (null);
    /** Reason why the cell refuses; empty if it does not refuse, or does not answer. */
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

  /** @param {number} ms  until the next attempt */
  again(ms) {
    clearTimeout(this.later);
    this.later = setTimeout(() => {
      if (this.lostAt === null) return;
      this.drop();
      this.silentSince = performance.now();
      this.open();
    }, ms);
  }

  /** Connects to another address; received data is kept.  @param {string} address */
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

  /** Replaces a connection that receives no messages or cannot be established. */
  look() {
    if (this.lostAt !== null) this.onChange();  // to update the shown duration
    if (performance.now() - this.silentSince < SILENT_MS || this.socket === null) return;
    this.drop();
    this.lose();
    this.again(0);
  }

  /** Asks why a connection was refused, which browsers do not report. */
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
