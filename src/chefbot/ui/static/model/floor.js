// The floor of the 3-D picture as a view for the map's tools: pixels to metres of the map, and the arrow of a drag.
import { Plane, Raycaster, Vector2, Vector3 } from "three";

const UP = new Vector3(0, 0, 1);

export class Floor {
  constructor({ canvas, stage, frames, live }, aimed) {
    Object.assign(this, { canvas, stage, frames, live, aimed });
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  // null where one looks past the floor, into the sky.
  metres(px, py) {
    const { camera } = this.stage, map = this.frames.home;
    this.frames.settle();
    camera.updateMatrixWorld();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2(2 * px / this.canvas.clientWidth - 1, 1 - 2 * py / this.canvas.clientHeight), camera);
    const origin = map.getWorldPosition(new Vector3());
    const floor = new Plane().setFromNormalAndCoplanarPoint(UP.clone().transformDirection(map.matrixWorld), origin);
    const place = caster.ray.intersectPlane(floor, new Vector3());
    return place && map.worldToLocal(place);
  }

  rest(on) { this.stage.controls.enabled = !on; }

  refresh() {
    this.live.take("aim", this.aimed(this));
    this.stage.refresh();
  }
}
