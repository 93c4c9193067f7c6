#include "tests/bench/peers/rope_peer.h"

#ifdef STRANDCAST_HAS_BULLET

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "common/base/profile.h"

namespace strandcast {
namespace {

/// Ropes side by side along +x from z = 0, 0.01, ...; node 0 of each is held.
class RopeWorld {
 public:
  explicit RopeWorld(const RopeSetup& setup)
      : step_s_(static_cast<btScalar>(setup.step_s)),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    constexpr btScalar kSpacingM = 0.01f;
    constexpr btScalar kRopeMassKg = 3e-6f;  // of a hair; distance constraints do not care
    const btVector3 gravity(0.0f, -9.81f, 0.0f);
    world_.setGravity(gravity);
    world_.getWorldInfo().m_gravity = gravity;
    world_.getWorldInfo().air_density = 0.0f;
    for (uint32_t i = 0; i < setup.rope_count; ++i) {
      const btVector3 root(0.0f, 0.0f, kSpacingM * static_cast<btScalar>(i));
      const btVector3 tip = root + btVector3(static_cast<btScalar>(setup.length_m), 0.0f, 0.0f);
      btSoftBody* rope = btSoftBodyHelpers::CreateRope(world_.getWorldInfo(), root, tip,
                                                       static_cast<int>(setup.node_count) - 2, 1);
      rope->setTotalMass(kRopeMassKg);
      rope->setMass(0, 0.0f);
      rope->m_cfg.piterations = static_cast<int>(setup.iterations);
      rope->m_cfg.collisions = 0;
      world_.addSoftBody(rope);
      ropes_.push_back(rope);
    }
  }
  ~RopeWorld() {
    for (btSoftBody* rope : ropes_) {
      world_.removeSoftBody(rope);
      delete rope;
    }
  }
  RopeWorld(const RopeWorld&) = delete;
  RopeWorld& operator=(const RopeWorld&) = delete;

  void step() { world_.stepSimulation(step_s_, 1, step_s_); }

  void measure(RopeStretch& largest) const {
    for (const btSoftBody* rope : ropes_) {
      double rest_m = 0.0;
      double total_m = 0.0;
      for (int i = 0; i < rope->m_links.size(); ++i) {
        const btSoftBody::Link& link = rope->m_links[i];
        const double length_m = (link.m_n[0]->m_x - link.m_n[1]->m_x).length();
        largest.segment = std::max(largest.segment, length_m / static_cast<double>(link.m_rl) - 1.0);
        rest_m += static_cast<double>(link.m_rl);
        total_m += length_m;
      }
      largest.whole = std::max(largest.whole, total_m / rest_m - 1.0);
    }
  }

 private:
  btScalar step_s_;
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btSoftRigidDynamicsWorld world_;
  std::vector<btSoftBody*> ropes_;
};

}  // namespace

const char* rope_peer_name() {
  static const std::string name = fmt::format("Bullet {}.{}", btGetVersion() / 100, btGetVersion() % 100);
  return name.c_str();
}

RopeStretch rope_stretch(const RopeSetup& setup, double seconds) {
  RopeWorld world(setup);
  RopeStretch largest;
  for (double time_s = 0.0; time_s < seconds; time_s += setup.step_s) {
    world.step();
    world.measure(largest);
  }
  return largest;
}

double rope_step_ms(const RopeSetup& setup, int steps) {
  RopeWorld world(setup);
  std::vector<double> samples_ms;
  for (int step = 0; step < 2 * steps; ++step) {
    const int64_t begin_ns = now_ns();
    world.step();
    if (step >= steps) samples_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
  }
  return *std::min_element(samples_ms.begin(), samples_ms.end());
}

}  // namespace strandcast

#else

namespace strandcast {

const char* rope_peer_name() {
  return "";
}
RopeStretch rope_stretch(const RopeSetup&, double) {
  return {};
}
double rope_step_ms(const RopeSetup&, int) {
  return 0.0;
}

}  // namespace strandcast

#endif
