// SPDX-License-Identifier: Apache-2.0
// The moment that the whole page shows, and its play. Everything else listens.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

export class Player {
  constructor(duration_s) {
    this.duration_s = duration_s;
    this.t_s = 0;
    this.speed = 1;
    this.playing = false;
    this.listeners_ = [];
    this.pending_ = false;
  }

  /** Calls back with the time, now and after every change, at most once a picture of the screen. */
  listen(call) {
    this.listeners_.push(call);
    call(this.t_s);
  }

  seek(t_s) {
    const t = Math.min(Math.max(Number(t_s) || 0, 0), this.duration_s);
    this.t_s = t;
    this.announce_();
  }

  /** What waits for the next picture of the screen is done now. */
  flush() {
    this.pending_ = false;
    for (const call of this.listeners_) call(this.t_s);
  }

  announce_() {
    if (this.pending_) return;
    this.pending_ = true;
    requestAnimationFrame(() => {
      if (this.pending_) this.flush();
    });
  }

  setSpeed(speed) {
    this.speed = speed;
    this.announce_();
  }

  faster(by) {
    const i = SPEEDS.indexOf(this.speed);
    this.setSpeed(SPEEDS[Math.min(Math.max(i + by, 0), SPEEDS.length - 1)]);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  pause() {
    this.playing = false;
    this.announce_();
  }

  play() {
    if (this.t_s >= this.duration_s - 1e-6) this.t_s = 0;
    this.playing = true;
    let last_ms = performance.now();
    const tick = (now_ms) => {
      if (!this.playing) return;
      this.t_s = Math.min(this.t_s + ((now_ms - last_ms) / 1000) * this.speed, this.duration_s);
      last_ms = now_ms;
      if (this.t_s >= this.duration_s) this.playing = false;
      this.flush();
      if (this.playing) requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    this.announce_();
  }
}
