// The role of the reader's link; the style sheet hides what it may not command. The last one is kept for the time until
// the robot answers, as when the installed app is opened while the robot is off.
import { tr } from "./language.js";

const KEY = "chefbot-role";

export function showRole(role) {
  show(role);
  try { localStorage.setItem(KEY, role); } catch { /* a browser that keeps nothing shows all until the robot answers */ }
}

function show(role) {
  document.body.dataset.role = role;
  document.querySelector("[data-tab=drive]").textContent = role === "waiter" ? tr("Camera") : tr("Drive");
}

try { show(localStorage.getItem(KEY) ?? ""); } catch { show(""); }
