// The service worker: it passes every request on to the robot, and answers with the kept file if the robot does not.
const KEPT = "page";                     // name of the cache, also in offline.js
const PATIENCE = 5000;                   // milliseconds until the first bytes
const FILE = /\.(js|css|svg|json|png)$/; // recordings and pictures of the robot are not kept

self.addEventListener("install", () => self.skipWaiting());
self.addEventListener("activate", (event) => event.waitUntil(self.clients.claim()));
self.addEventListener("notificationclick", (event) => {
  event.notification.close();
  event.waitUntil(show());
});
self.addEventListener("fetch", (event) => {
  const { request } = event, path = new URL(request.url).pathname;
  const opens = request.mode === "navigate" && path === "/";
  if (request.method === "GET" && (opens || FILE.test(path))) event.respondWith(answer(request, path));
});

async function answer(request, path) {
  const cache = await caches.open(KEPT);
  try {
    const fresh = await inTime(fetch(request));
    // The answer to an address with a token is a redirection, which is not kept. A full disk keeps the older file.
    if (fresh.status === 200 && fresh.type === "basic") cache.put(path, fresh.clone()).catch(() => null);
    return fresh;
  } catch (error) {
    const kept = await cache.match(path);
    if (!kept) throw error;
    return kept;
  }
}

function inTime(promise) {
  const late = new Promise((_, reject) => setTimeout(() => reject(new Error("no answer in time")), PATIENCE));
  return Promise.race([promise, late]);
}

// The page that is open, else a new one.
async function show() {
  const [page] = await self.clients.matchAll({ type: "window" });
  return page ? page.focus() : self.clients.openWindow("./");
}
