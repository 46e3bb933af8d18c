// Switches the lights of a .glb off, so that a frame of it shows its lightmaps and nothing that programs shade in ways of their own:
//   node lights_off.mjs LEVEL.baked.glb OUT.baked.glb

import { readFileSync, writeFileSync } from 'node:fs';

const [ from, to ] = process.argv.slice( 2 );
const file = readFileSync( from );
if ( file.toString( 'latin1', 0, 4 ) !== 'glTF' ) throw new Error( `${ from } is no .glb` );
const end = 20 + file.readUInt32LE( 12 );
const json = JSON.parse( file.toString( 'utf8', 20, end ) );
for ( const light of json.extensions?.KHR_lights_punctual?.lights ?? [] )
	( ( light.extensions ??= {} ).LUMBRE_lights_phong ??= {} ).enabled = false;
json.extensionsUsed = [ ...new Set( [ ...( json.extensionsUsed ?? [] ), 'LUMBRE_lights_phong' ] ) ];
let text = Buffer.from( JSON.stringify( json ) );
text = Buffer.concat( [ text, Buffer.alloc( ( 4 - text.length % 4 ) % 4, ' ' ) ] );
const head = Buffer.from( file.subarray( 0, 20 ) );
head.writeUInt32LE( 20 + text.length + file.length - end, 8 );
head.writeUInt32LE( text.length, 12 );
writeFileSync( to, Buffer.concat( [ head, text, file.subarray( end ) ] ) );
