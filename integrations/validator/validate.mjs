// The Khronos glTF validator over files: exits with 1 if one has an error or a warning.
//   node validate.mjs [--all] FILE.glb|FILE.gltf …        (--all prints information and hints too)
import { readFile } from 'node:fs/promises';
import { dirname, resolve } from 'node:path';
import validator from 'gltf-validator';

const SEVERITIES = ['error', 'warning', 'information', 'hint'];
const files = process.argv.slice(2).filter((argument) => argument !== '--all');
const all = process.argv.includes('--all');
if (files.length === 0) {
  console.error('usage: validate [--all] FILE.glb|FILE.gltf …');
  process.exit(2);
}
let bad = 0;
for (const file of files) {
  let report;
  try {
    const bytes = new Uint8Array(await readFile(file));
    report = await validator.validateBytes(bytes, {
      uri: file,
      maxIssues: 0,
      externalResourceFunction: async (uri) => new Uint8Array(await readFile(resolve(dirname(file), decodeURIComponent(uri)))),
    });
  } catch (error) {
    console.log(`${file}: not read: ${error.message ?? error}`);
    bad += 1;
    continue;
  }
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  const counts = new Map();
  for (const { severity, code, message, pointer } of messages.filter(({ severity }) => all || severity < 2)) {
    const seen = (counts.get(code) ?? 0) + 1;
    counts.set(code, seen);
    if (seen <= 3) console.log(`  ${SEVERITIES[severity]} ${code} ${pointer ?? ''}: ${message}`);
  }
  for (const [code, seen] of counts) if (seen > 3) console.log(`  … ${code} ${seen} times in all`);
  bad += numErrors + numWarnings > 0 ? 1 : 0;
}
process.exit(bad > 0 ? 1 : 0);
