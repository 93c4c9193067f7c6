#include "common/scene/scene_desc.h"

namespace strandcast {

SceneDesc built_in_scene() {
  SceneDesc scene;
  // A light breeze from the front left: strong enough to see, too weak to lift the hair off the head.
  scene.wind.mean_mps = {0.9f, 0.0f, -1.2f};
  scene.wind.gust_intensity = 0.5f;
  // Most of the weight pulls on the strands: hair that carries all of its own weight bounces with every step.
  scene.solver.parameters["sag_free"] = 0.3;
  return scene;
}

}  // namespace strandcast
