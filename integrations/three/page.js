// A page that shows a baked .glb or .gltf: ?file=URL&camera=NAME&exposure=X&lightmaps=exr|ktx2. `window.frame( width, height )` answers with
// linear radiance, for comparing.

import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';
import { LumbreLightmapPlugin } from './lumbre-lightmap.js';

const asked = new URLSearchParams( location.search );
const words = document.getElementById( 'words' );

const renderer = new THREE.WebGLRenderer( { antialias: true } );
// The tone curve that Lumbre shows its frames by.
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.toneMappingExposure = Number( asked.get( 'exposure' ) ?? 1 );
document.body.append( renderer.domElement );

const loader = new GLTFLoader();
// Meshes without lightmaps, such as characters, stay compressed in a baked file if they were.
loader.setDRACOLoader( new DRACOLoader().setDecoderPath( './node_modules/three/examples/jsm/libs/draco/gltf/' ) );
const ktx2Loader = asked.get( 'lightmaps' ) === 'ktx2' ? new KTX2Loader().detectSupport( renderer ) : null;
loader.register( ( parser ) => new LumbreLightmapPlugin( parser, { ktx2Loader } ) );

async function show() {

	const gltf = await loader.loadAsync( asked.get( 'file' ) ?? 'level.baked.glb' );
	const scene = gltf.scene;
	const settings = gltf.parser.json.scenes?.[ gltf.parser.json.scene ?? 0 ]?.extensions?.LUMBRE_scene;
	if ( settings?.background ) scene.background = new THREE.Color().setRGB( ...settings.background );

	scene.updateMatrixWorld( true );
	const wanted = asked.get( 'camera' );
	const named = cameraOf( gltf, wanted );
	if ( wanted !== null && ! named ) throw new Error( `there is no camera ${ wanted }` );
	const camera = new THREE.PerspectiveCamera( named?.fov ?? 45, 1, named?.near ?? 0.05, 1000 );
	const box = new THREE.Box3().setFromObject( scene );
	const middle = box.getCenter( new THREE.Vector3() );

	if ( named ) {

		named.matrixWorld.decompose( camera.position, camera.quaternion, camera.scale );

	} else {

		camera.position.copy( middle ).add( new THREE.Vector3( 0.3, 0.4, 1 ).setLength( 1.2 * box.getSize( new THREE.Vector3() ).length() ) );
		camera.lookAt( middle );

	}

	// The controls turn their camera.
	const still = camera.clone();
	window.frame = ( width, height ) => linear( scene, still, width, height );
	window.lightmapped = count( scene );

	// The page itself, for people.
	const forward = new THREE.Vector3( 0, 0, - 1 ).applyQuaternion( camera.quaternion );
	const controls = new OrbitControls( camera, renderer.domElement );
	const ahead = Math.max( 0.1, middle.clone().sub( still.position ).dot( forward ) );
	controls.target.copy( still.position ).addScaledVector( forward, ahead );
	controls.update();
	const resize = () => {

		renderer.setSize( innerWidth, innerHeight );
		camera.aspect = innerWidth / innerHeight;
		camera.updateProjectionMatrix();

	};

	addEventListener( 'resize', resize );
	resize();
	words.textContent = `${ window.lightmapped } meshes with lightmaps`;
	renderer.setAnimationLoop( () => renderer.render( scene, camera ) );

}

// The camera of the node with a name, or the first one.
function cameraOf( { scene, parser }, name ) {

	let found = null;
	scene.traverse( ( object ) => {

		// GLTFLoader's own names have no spaces.
		const node = parser.associations.get( object )?.nodes ?? parser.associations.get( object.parent )?.nodes;
		const fits = name === null || parser.json.nodes[ node ]?.name === name;
		if ( object.isPerspectiveCamera && fits ) found ??= object;

	} );
	return found;

}

// Radiance as floats, the top row first.
function linear( scene, camera, width, height ) {

	renderer.setAnimationLoop( null );
	const target = new THREE.WebGLRenderTarget( width, height, { type: THREE.FloatType, samples: 4 } );
	camera.aspect = width / height;
	camera.updateProjectionMatrix();
	const toneMapping = renderer.toneMapping;
	renderer.toneMapping = THREE.NoToneMapping;
	renderer.setRenderTarget( target );
	renderer.render( scene, camera );
	renderer.setRenderTarget( null );
	renderer.toneMapping = toneMapping;
	const pixels = new Float32Array( 4 * width * height );
	renderer.readRenderTargetPixels( target, 0, 0, width, height, pixels );
	target.dispose();
	const rows = [];
	for ( let row = height - 1; row >= 0; row -- ) rows.push( ...pixels.subarray( 4 * width * row, 4 * width * ( row + 1 ) ) );
	return rows;

}

function count( scene ) {

	let meshes = 0;
	scene.traverse( ( object ) => { if ( object.isMesh && object.material.lightMap ) meshes ++; } );
	return meshes;

}

show().catch( ( error ) => {

	console.error( error );
	words.textContent = String( error );
	window.failed = String( error );

} );
