// A ZIP archive of files, each compressed by the browser.
const CRC = Uint32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; bit++) {
    byte = byte & 1 ? (byte >>> 1) ^ 0xedb88320 : byte >>> 1;
  }
  return byte;
});

function checksum(bytes) {
  let sum = -1;
  for (const byte of bytes) {
    sum = CRC[(sum ^ byte) & 255] ^ (sum >>> 8);
  }
  return (sum ^ -1) >>> 0;
}

// Fields of 2 and 4 bytes, the lowest byte first.
function fields(...values) {
  const view = new DataView(new ArrayBuffer(values.reduce((size, [bytes]) => size + bytes, 0)));
  let place = 0;
  for (const [bytes, value] of values) {
    bytes === 2 ? view.setUint16(place, value, true) : view.setUint32(place, value, true);
    place += bytes;
  }
  return view.buffer;
}

// The archive as a Blob; `entries` are pairs of a name and a Blob.
export async function archive(entries) {
  const parts = [], directory = [];
  let offset = 0;
  for (const [name, blob] of entries) {
    const bytes = new Uint8Array(await blob.arrayBuffer());
    const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate-raw"));
    const content = await new Response(stream).arrayBuffer();
    const text = new TextEncoder().encode(name);
    // Version 2.0, names in UTF-8, deflated, 1 January 1980.
    const shared = [[2, 20], [2, 0x800], [2, 8], [2, 0], [2, 33], [4, checksum(bytes)], [4, content.byteLength],
      [4, bytes.length], [2, text.length], [2, 0]];
    const local = [fields([4, 0x04034b50], ...shared), text, content];
    directory.push(fields([4, 0x02014b50], [2, 20], ...shared, [2, 0], [2, 0], [2, 0], [4, 0], [4, offset]), text);
    parts.push(...local);
    offset += new Blob(local).size;
  }
  const size = new Blob(directory).size;
  const end = fields([4, 0x06054b50], [2, 0], [2, 0], [2, entries.length], [2, entries.length], [4, size], [4, offset], [2, 0]);
  return new Blob([...parts, ...directory, end], { type: "application/zip" });
}
