// Colours of what the map shows, for light and dark.

const dark = window.matchMedia("(prefers-color-scheme: dark)");

export const isDark = () => dark.matches;
const pick = (light, darker) => (dark.matches ? darker : light);

export const COLOURS = {
  path: () => pick("#0f766e", "#2dd4bf"),
  local_path: () => pick("#7c3aed", "#a78bfa"),
  particles: () => pick("#2563eb99", "#60a5faaa"),
  scan: () => pick("#dc2626", "#f87171"),
  obstacles: () => pick("#d97706", "#fbbf24"),
  goal: () => pick("#0f766e", "#2dd4bf"),
  truth: () => pick("#16a34a", "#4ade80"),
  people: () => pick("#be185d", "#f472b6"),
  robot: () => pick("#1d2522", "#e6ebe8"),
  tyre: () => pick("#66716c", "#66716c"),
  heading: () => pick("#5eead4", "#0f766e"),
  dish: () => "#f59e0b",
  cone: () => pick("#0f766e2e", "#2dd4bf30"),
  coneEnd: () => pick("#0f766e00", "#2dd4bf00"),
  map_error: () => "#fdae61",
  costmap: () => "#e0592b",
  local_costmap: () => "#e0592b",
  candidates: () => pick("#15803d", "#4ade80"),
  places: () => pick("#4c5652", "#a9b5af"),
  causes: () => pick("#be123c", "#fb7185"),
  zones: () => pick("#b45309", "#f59e0b"),
  keep_out: () => pick("#b91c1c", "#f87171"),
  preferred: () => pick("#15803d", "#4ade80"),
  one_way: () => pick("#1d4ed8", "#60a5fa"),
  halo: () => pick("#ffffffdd", "#121614dd"),
  floor: () => pick("#ffffff", "#1f2724"),
  doubtful: () => pick("#d6dbd7", "#3b4541"),
  wall: () => pick("#3a4540", "#c3ccc7"),
  solidWall: () => pick("#c2cbc6", "#6f7b75"),   // in 3-D, where light shades it
};
