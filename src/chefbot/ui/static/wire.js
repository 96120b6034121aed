// The web UI's half of the format that chefbot/ui/protocol.py describes.

export async function decode(data) {
  if (typeof data === "string") return JSON.parse(data);
  const size = new DataView(data).getUint16(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 2, size)));
  const body = data.slice(2 + size);
  return { layer: head.layer, value: await READERS[head.kind](head, body) };
}

const READERS = {
  points: async (head, body) => points(head, new DataView(body)),
  int8: async (head, body) => ({ ...head, cells: new Int8Array(await inflate(body)) }),
  uint8: async (head, body) => ({ ...head, cells: new Uint8Array(await inflate(body)) }),
  depth: async (head, body) => ({ ...head, millimetres: new Uint16Array(await inflate(body)) }),
  jpeg: async (head, body) => new Blob([body], { type: "image/jpeg" }),
};

function points(head, view) {
  const n = view.byteLength / 2;
  const rows = new Float32Array(n);
  const offset = [head.x, head.y, 0];
  for (let i = 0; i < n; i++) {
    const column = i % head.columns;
    rows[i] = offset[column] + head.unit[column] * view.getInt16(2 * i, true);
  }
  return { columns: head.columns, count: n / head.columns, rows, frame: head.frame };
}

async function inflate(body) {
  const stream = new Blob([body]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}
