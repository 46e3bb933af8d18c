// A plugin for three.js' GLTFLoader: hangs the lightmaps that `lumbre bake` wrote on the meshes of a baked glTF file.
//
//   const loader = new GLTFLoader();
//   loader.register( parser => new LumbreLightmapPlugin( parser ) );
//
// A texel of a lightmap is E/π: irradiance over π, in the units of radiance that KHR_lights_punctual gives a frame. three.js wants irradiance
// in `material.lightMap`, so its intensity is π.

import { LinearFilter, LoaderUtils, NoColorSpace, ShaderChunk } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

const NAME = 'LUMBRE_lightmap';
const LIGHTS = 'LUMBRE_lights_phong';

export class LumbreLightmapPlugin {

	// ktx2Loader: a KTX2Loader on which detectSupport() was called; then the .ktx2 images beside the OpenEXR ones are taken
	//   (`lumbre bake --ktx2 rgb9e5`): four bytes a texel instead of eight.
	// staticLights: lights whose light is in the lightmaps shine on what has none, such as characters, and leave their highlights on what has one; 'off'
	//   switches them off, which is quicker.
	constructor( parser, { ktx2Loader = null, staticLights = 'on' } = {} ) {

		this.name = NAME;
		this.parser = parser;
		this.ktx2Loader = ktx2Loader;
		this.staticLights = staticLights;
		this.textures = new Map();
		this.materials = new Map();
		this.bakedLights = new BakedLights();

	}

	// GLTFLoader calls this once everything else is there.
	async afterRoot( gltf ) {

		const pending = [];
		let lightmapped = false;

		for ( const scene of gltf.scenes ) {

			scene.traverse( ( object ) => {

				const node = this.nodeOf( object );
				const extension = node?.extensions?.[ NAME ];
				if ( ! extension ) return;
				lightmapped = true;
				for ( const mesh of this.meshesOf( object ) ) pending.push( this.attach( mesh, extension ) );

			} );

		}

		await Promise.all( pending );
		if ( lightmapped ) this.markLights( gltf );

	}

	// The glTF node that an object was made for.
	nodeOf( object ) {

		const index = this.parser.associations.get( object )?.nodes;
		return index === undefined ? null : this.parser.json.nodes[ index ];

	}

	// The meshes of a node: the object itself, or a child for each primitive. Children that are nodes of their own have lightmaps of their own.
	meshesOf( object ) {

		return [ object, ...object.children.filter( ( child ) => this.nodeOf( child ) === null ) ]
			.flatMap( ( one ) => one.isMesh ? [ one ] : one === object ? [] : one.children.filter( ( child ) => child.isMesh ) );

	}

	async attach( mesh, extension ) {

		const set = extension.texCoord ?? 1;
		if ( ! mesh.geometry.getAttribute( set === 0 ? 'uv' : `uv${ set }` ) ) {

			console.warn( `LumbreLightmapPlugin: ${ mesh.name } has no TEXCOORD_${ set }; bake the file again` );
			return;

		}

		const lightMap = await this.texture( extension.image, set );
		// Nodes share materials and not lightmaps.
		const materials = [].concat( mesh.material ).map( ( material ) => this.lit( material, lightMap ) );
		mesh.material = Array.isArray( mesh.material ) ? materials : materials[ 0 ];
		this.bakedLights.watch( mesh );

	}

	lit( material, lightMap ) {

		const key = `${ material.uuid } ${ lightMap.uuid }`;
		if ( ! this.materials.has( key ) ) {

			const lit = material.clone();
			lit.lightMap = lightMap;
			lit.lightMapIntensity = Math.PI;
			this.bakedLights.leaveOut( lit );
			this.materials.set( key, lit );

		}

		return this.materials.get( key );

	}

	texture( image, set ) {

		const key = `${ image } ${ set }`;
		if ( ! this.textures.has( key ) ) this.textures.set( key, this.load( image, set ) );
		return this.textures.get( key );

	}

	async load( image, set ) {

		const packed = this.ktx2Loader !== null || /\.ktx2$/i.test( image );
		if ( packed && this.ktx2Loader === null ) throw new Error( `LumbreLightmapPlugin: ${ image } wants a ktx2Loader` );
		const name = packed ? image.replace( /\.exr$/i, '.ktx2' ) : image;
		const url = LoaderUtils.resolveURL( name, this.parser.options.path );
		const loader = packed ? this.ktx2Loader : new EXRLoader( this.parser.options.manager );
		const texture = await loader.loadAsync( url );

		if ( ! packed ) {

			// EXRLoader puts the bottom row first, glTF's coordinates begin at the top.
			texture.repeat.y = - 1;
			texture.offset.y = 1;

		}

		texture.name = name;
		texture.channel = set;
		texture.colorSpace = NoColorSpace;
		texture.minFilter = LinearFilter;
		texture.magFilter = LinearFilter;
		texture.generateMipmaps = false;
		texture.needsUpdate = true;
		return texture;

	}

	// Which lights are in the maps, and which are off.
	markLights( gltf ) {

		const lights = this.parser.json.extensions?.KHR_lights_punctual?.lights ?? [];

		for ( const scene of gltf.scenes ) {

			scene.traverse( ( object ) => {

				if ( ! object.isLight ) return;
				// The object of the light is that of its node, or lies below it.
				const node = this.nodeOf( object ) ?? this.nodeOf( object.parent );
				const index = node?.extensions?.KHR_lights_punctual?.light;
				const light = index === undefined ? null : lights[ index ];
				const phong = light?.extensions?.[ LIGHTS ];
				const baked = light && ( phong?.bake ?? 'static' ) === 'static';
				if ( phong?.enabled === false || ( baked && this.staticLights === 'off' ) ) object.visible = false;
				else if ( baked ) this.bakedLights.lights.add( object );

			} );

		}

	}

}

const KINDS = [ 'Point', 'Spot', 'Dir' ];

// Takes the diffuse light of baked lights off lightmapped materials, and leaves their highlights. three.js numbers lights of a kind anew in each
// frame; a bit of a mask says of each number whether that light is baked.
class BakedLights {

	constructor() {

		this.lights = new Set();
		this.materials = new Set();
		this.masks = { value: [ 0, 0, 0 ] };
		this.seen = { frame: - 1, camera: null };

	}

	leaveOut( material ) {

		const before = material.onBeforeCompile, key = material.customProgramCacheKey();
		material.onBeforeCompile = ( shader, renderer ) => {

			before.call( material, shader, renderer );
			shader.uniforms.bakedLights = this.masks;
			shader.fragmentShader = `uniform ivec3 bakedLights;\n${ shader.fragmentShader }`
				.replace( '#include <lights_fragment_begin>', WITHOUT_BAKED_LIGHTS );

		};

		material.customProgramCacheKey = () => `${ key } without the diffuse light of baked lights`;
		this.materials.add( material );

	}

	// Keeps the masks up to date while a mesh is drawn.
	watch( mesh ) {

		const before = mesh.onBeforeRender;
		mesh.onBeforeRender = ( renderer, scene, camera, ...more ) => {

			before.call( mesh, renderer, scene, camera, ...more );
			const { frame } = renderer.info.render;
			if ( this.seen.frame === frame && this.seen.camera === camera ) return;
			this.seen = { frame, camera };
			const masks = this.masksOf( scene, camera );
			if ( masks.every( ( mask, kind ) => mask === this.masks.value[ kind ] ) ) return;
			this.masks.value = masks;
			for ( const material of this.materials ) material.needsUpdate = true;

		};

	}

	masksOf( scene, camera ) {

		const lights = [];
		scene.traverseVisible( ( object ) => { if ( object.isLight && object.layers.test( camera.layers ) ) lights.push( object ); } );
		// The order that WebGLLights brings them into.
		const rank = ( light ) => ( light.castShadow ? 2 : 0 ) + ( light.map ? 1 : 0 );
		lights.sort( ( a, b ) => rank( b ) - rank( a ) );
		return [ 'isPointLight', 'isSpotLight', 'isDirectionalLight' ].map( ( kind ) =>
			lights.filter( ( light ) => light[ kind ] ).reduce( ( mask, light, number ) => number < 32 && this.lights.has( light ) ? mask | 1 << number : mask, 0 ) );

	}

}

// Each loop over lights of a kind, with what it adds to the diffuse light taken back where the light is baked.
const WITHOUT_BAKED_LIGHTS = KINDS.reduce( ( chunk, kind, place ) => {

	const [ before, ...loop ] = chunk.split( `i < NUM_${ kind.toUpperCase() }_LIGHTS; i ++` );
	return before + loop.map( ( text ) => `i < NUM_${ kind.toUpperCase() }_LIGHTS; i ++` + text.replace( /RE_Direct\( .*\);/, ( call ) =>
		`vec3 before${ kind }_UNROLLED_LOOP_INDEX = reflectedLight.directDiffuse;
		${ call }
		if ( ( bakedLights[ ${ place } ] >> UNROLLED_LOOP_INDEX & 1 ) == 1 ) reflectedLight.directDiffuse = before${ kind }_UNROLLED_LOOP_INDEX;` ) ).join( '' );

}, ShaderChunk.lights_fragment_begin );
