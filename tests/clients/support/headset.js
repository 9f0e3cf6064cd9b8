// An emulated headset whose wearer's body is a clip. Runs in the page before its own scripts, after IWER's.
// window.headset = { clip, begin, hipsAt(ms), draws }; IWER has no body tracking, so frame.body is added here.
(() => {
  const { XRDevice, metaQuest3 } = IWER;
  const device = new XRDevice(metaQuest3);
  device.installRuntime({ forceInstall: true });
  device.position.set(0, 1.45, 2.4); // in front of the wearer, looking along -Z at them: what a second person would see
  const clip = window.headsetClip;
  const joints = clip && new Map(clip.names.map((name, k) => [name, { jointName: name, k }]));
  const started = performance.timeOrigin + performance.now();
  const place = (track, ms) => {
    const at = (((ms - started) / 1000) * clip.rate) % (track.length - 1);
    const t = Math.floor(at);
    const share = at - t;
    const mix = (a, b) => a.map((value, axis) => (1 - share) * value + share * b[axis]);
    return (k) => (k === undefined ? mix(track[t], track[t + 1]) : mix(track[t][k], track[t + 1][k]));
  };
  if (clip) {
    const { getPose } = XRFrame.prototype;
    Object.defineProperty(XRFrame.prototype, "body", { configurable: true, get: () => joints });
    XRFrame.prototype.getPose = function (space, base) {
      if (space.jointName === undefined) return getPose.call(this, space, base);
      const [x, y, z] = place(clip.positions, performance.timeOrigin + performance.now())(space.k);
      return { transform: { position: { x, y, z, w: 1 }, orientation: { x: 0, y: 0, z: 0, w: 1 } }, emulatedPosition: false };
    };
  }
  // What each draw of the present picture writes: colour and depth.
  const draws = [];
  const { drawElements } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.drawElements = function (...args) {
    if (window.headset.watching) {
      draws.push({
        colour: this.getParameter(this.COLOR_WRITEMASK).some(Boolean),
        depth: this.getParameter(this.DEPTH_WRITEMASK) && this.isEnabled(this.DEPTH_TEST),
        count: args[1],
      });
    }
    return drawElements.apply(this, args);
  };
  window.headset = { device, draws, watching: false, hipsAt: (ms) => place(clip.hips, ms)() };
})();
