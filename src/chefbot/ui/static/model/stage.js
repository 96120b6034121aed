// Camera, light, ground and the drawing itself. World axes are the robot's (REP-103): z is up, nothing is converted.
import {
  Color, DirectionalLight, DoubleSide, Group, HemisphereLight, Mesh, NeutralToneMapping, PCFShadowMap, PerspectiveCamera,
  PlaneGeometry, Scene, ShaderMaterial, ShadowMaterial, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "../vendor/three/controls/OrbitControls.js";

const GROUND = 400;                      // metres: the plane ends beyond where its lines have faded
const LIGHT = new Vector3(1.1, -0.5, 2.2);
const FROM = new Vector3(1.0, -1.15, 0.75).normalize();   // from ahead and to the right, a little above

export class Stage {
  constructor(canvas, prepare) {
    this.canvas = canvas;
    this.prepare = prepare;              // called before each picture
    this.pending = false;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.renderer.toneMapping = NeutralToneMapping;   // keeps the colours that the solids were given
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.autoClear = false;
    this.camera = new PerspectiveCamera(32, 1, 0.02, 300);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 0.05;
    this.controls.maxDistance = 120;
    this.controls.addEventListener("change", () => this.refresh());
    this.scene = new Scene();
    this.overlay = new Scene();          // drawn over everything, such as frames inside the body
    this.light();
    this.ground();
    this.look(new Vector3(0, 0, 0.2), 0.4);
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  light() {
    const sun = new DirectionalLight(0xfff8ec, 1.9);
    sun.castShadow = true;
    sun.shadow.mapSize.set(1024, 1024);
    sun.shadow.radius = 4;
    sun.shadow.bias = -0.0006;
    sun.shadow.normalBias = 0.002;
    this.sun = sun;
    this.sky = new HemisphereLight(0xffffff, 0xe2ddd0, 2.0);
    this.sky.position.set(0, 0, 1);
    this.scene.add(sun, sun.target, this.sky);
  }

  ground() {
    this.floor = new Group();
    this.grid = new Mesh(new PlaneGeometry(GROUND, GROUND), gridMaterial());
    const shade = new Mesh(this.grid.geometry, new ShadowMaterial({ opacity: 0.2, depthWrite: false }));
    this.grid.renderOrder = -9;
    shade.renderOrder = -5;
    shade.receiveShadow = true;
    this.floor.add(this.grid, shade);
    this.scene.add(this.floor);
    this.paintGround();
  }

  // The web UI's own colours, for light and for dark.
  paintGround() {
    const colour = (name) => new Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
    const back = colour("--ground");
    this.scene.background = back;
    this.grid.material.uniforms.line.value = colour("--quiet");
    this.sky.intensity = back.r > 0.5 ? 2.0 : 1.6;
    this.refresh();
  }

  // From ahead of what faces there, and from far enough that a ball of this radius fills the picture.
  look(target, radius, heading = 0) {
    const narrow = Math.min(1, this.camera.aspect);
    const far = 1.12 * radius / Math.sin(this.camera.fov * Math.PI / 360) / narrow;
    this.controls.target.copy(target);
    this.camera.position.copy(FROM).applyAxisAngle(this.camera.up, heading).multiplyScalar(far).add(target);
    this.reach = radius;
    this.heading = heading;              // the light comes from where one looked first
    this.controls.update();
    this.refresh();
  }

  // From above, so that a rectangle of the floor fills the picture.
  lookDown(centre, size) {
    const far = 0.62 * size / Math.tan(this.camera.fov * Math.PI / 360) / Math.min(1, this.camera.aspect);
    this.controls.target.copy(centre);
    this.camera.position.set(0, -0.55, 0.83).multiplyScalar(far).add(centre);
    this.controls.update();
    this.refresh();
  }

  shift(by) {
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();                         // at once: a canvas of another size is empty
  }

  refresh() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      this.pending = false;
      if (this.canvas.clientWidth) this.draw();
    });
  }

  draw() {
    this.prepare();
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.renderer.clearDepth();
    this.renderer.render(this.overlay, this.camera);
  }

  // Light and ground go where one looks: shadows are sharp only near the robot.
  centre(place) {
    const reach = Math.max(0.3, 2.2 * this.reach), shadow = this.sun.shadow.camera;
    this.floor.position.set(place.x, place.y, 0);
    this.grid.material.uniforms.middle.value.set(place.x, place.y);
    this.sun.target.position.set(place.x, place.y, 0);
    this.sun.position.copy(LIGHT).applyAxisAngle(this.camera.up, this.heading).multiplyScalar(reach).add(this.sun.target.position);
    if (shadow.right !== reach) {
      Object.assign(shadow, { left: -reach, right: reach, bottom: -reach, top: reach, near: 0.05 * reach, far: 6 * reach });
      shadow.updateProjectionMatrix();
    }
  }
}

// Lines every 10 cm near by and every metre far off, one pixel wide, fading out; x of the fixed frame red, y green.
function gridMaterial() {
  return new ShaderMaterial({
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
    uniforms: { line: { value: new Color() }, middle: { value: new Vector3() } },
    vertexShader: `
      varying vec2 place;
      void main() {
        vec4 world = modelMatrix * vec4(position, 1.0);
        place = world.xy;
        gl_Position = projectionMatrix * viewMatrix * world;
      }`,
    fragmentShader: `
      uniform vec3 line; uniform vec3 middle; varying vec2 place;
      float lines(vec2 at, vec2 width) { vec2 far = abs(fract(at - 0.5) - 0.5) / width; return 1.0 - min(min(far.x, far.y), 1.0); }
      void main() {
        vec2 width = fwidth(place);
        float cell = max(width.x, width.y), away = distance(place, middle.xy);
        float fine = lines(place * 10.0, width * 10.0) * clamp(1.0 - cell * 45.0, 0.0, 1.0) * clamp(1.0 - away / 3.0, 0.0, 1.0);
        float coarse = lines(place, width) * clamp(1.0 - cell * 4.5, 0.0, 1.0);
        vec2 axis = 1.0 - min(abs(place) / (width * 1.4), 1.0);
        float seen = max(0.16 * fine, 0.34 * coarse);
        vec3 colour = mix(mix(line, vec3(0.72, 0.16, 0.18), axis.y), vec3(0.12, 0.5, 0.25), axis.x);
        seen = max(seen, 0.6 * max(axis.x, axis.y)) * exp(-away * away / 220.0);
        if (seen < 0.004) discard;
        gl_FragColor = vec4(colour, seen);
        #include <colorspace_fragment>
      }`,
  });
}
