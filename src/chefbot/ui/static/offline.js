// Keeps the web UI on the device, so that it opens without the robot and shows that the robot does not answer.
const KEPT = "page";                     // name of the cache, also in worker.js
const LOCAL = /^(localhost|127\..*|\[::1\])$/;    // there, another program may use the same address tomorrow

export async function keepOnDevice() {
  if (!window.isSecureContext || !("serviceWorker" in navigator) || LOCAL.test(location.hostname)) return;
  await navigator.serviceWorker.register("./worker.js");
  const cache = await caches.open(KEPT);
  if (await cache.match("/")) return;    // from the second visit on, the worker keeps what it passes on
  const loaded = performance.getEntriesByType("resource").map((entry) => new URL(entry.name));
  const files = loaded.filter((url) => url.origin === location.origin && /\.(js|css|svg|json|png)$/.test(url.pathname));
  await cache.addAll(["/", ...new Set(files.map((url) => url.pathname))]);
}
