// Predictor: predicts strands by running the solver that the stream announces from the last decoded state.
// Encoder and decoder of the "step" codec each have one. Both compute with the same numbers, so they predict
// every vertex with the same bits. Decoded positions then correct positions and velocities. Strands lie in
// coding order (tangent/layout.h), in blocks of 16. Private to common/strands; one thread.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/head_path.h"
#include "common/kernels/lane_program.h"
#include "common/kernels/step_model.h"
#include "common/kernels/volume/volume_law.h"
#include "common/strands/byte_io.h"
#include "common/strands/step/component.h"
#include "common/strands/step/step_reader.h"
#include "common/strands/step/tip_mask.h"
#include "common/strands/step/velocity_guess.h"
#include "common/strands/step/wire.h"
#include "common/strands/tangent/motion.h"
#include "common/strands/value_coder.h"

namespace strandcast::step {

/// What both sides know of the strands before the first frame. All of it must outlive the predictor.
struct PredictorGround {
  const tangent::Layout& layout;
  std::span<const glm::vec3> rest_in_head_m;  // (vertex_count x strand_count), strand fastest
  WorkerPool& workers;
  simd::InstructionSet set;
  Priority priority = Priority::Encoding;
};

/// Largest number of vertices that are predicted by steps; each takes up to 200 bytes of memory.
inline constexpr size_t kMostStepVertices = 2'000'000;

class Predictor {
 public:
  /// One for each component of a state: three planes with w, and the twist.
  using ComponentTables = std::array<Component::Kept, 13>;

  /// State that changes from frame to frame.
  struct State {
    std::array<std::unique_ptr<StrandBlocks>, kPlaneRoleCount> planes;
    HeadPath head;
    Pose pose;
    std::unique_ptr<StrandBlocks> body_before;  // where strands were, w = how near to the body they may come
    bool is_body_known = false;                 // w is
    bool is_history_known = true;               // what strands remember of the last substep
  };

  /// Makes a predictor. Unsupported if there is no rest shape or this build lacks the model's kernel.
  static Result<std::unique_ptr<Predictor>> make(StepModel model, const PredictorGround& ground);

  const StepModel& model() const { return model_; }
  void set_scene(const StepScene& scene);

  /// Decoded positions with the pose of the head. start() sets the strands to `now`; their velocities follow
  /// from `before`, `seconds` earlier (0: strands are at rest).
  struct Decoded {
    const tangent::Planes<int32_t>& lattice;
    Pose world_from_head;
  };
  void start(const Decoded& now, const Decoded& before, double seconds, float quantum_m);

  /// Decoded positions from which the next steps start.
  struct Origin {
    const tangent::Planes<int32_t>& lattice;
    float quantum_m;
  };
  /// Simulates one step per tick; `end_time_s` is the end of the last one.
  void advance(const Origin& origin, std::span<const StepTick> ticks, double end_time_s);
  /// Writes the predicted positions as lattice values; 0 where a place holds no strand.
  void expect(float quantum_m, tangent::Planes<int32_t>& lattice) const;
  /// Predicted and decoded positions of a frame that spans `seconds`; correct() moves the strands to the
  /// decoded ones.
  struct Correction {
    const tangent::Planes<int32_t>& expected;
    const tangent::Planes<int32_t>& decoded;
    double seconds;
    float quantum_m;
  };
  void correct(const Correction& correction);

  /// Rounds the state to the numbers that write_state() writes, so that joiners continue from the same state.
  /// Positions are set to the decoded ones.
  void settle(const tangent::Planes<int32_t>& decoded, float quantum_m);
  /// The same so finely that nobody sees it. What strands remember of the last substep is forgotten: the next
  /// step finds it again. `told`: null where the encoder has yet to tell it; it is guess() afterwards.
  void settle_finely(const tangent::Planes<int32_t>& decoded, float quantum_m, Rounding rounding,
                     const VelocityGuess* told);
  const VelocityGuess& guess() const { return guess_; }
  /// Appends the state for joiners; call settle() or settle_finely() first.
  void write_state(std::vector<std::byte>& bytes) const;
  /// Reads what write_state() wrote, under this pose of the head. BadInput for malformed bytes. Call place()
  /// afterwards.
  Status read_state(ByteReader& bytes, const Pose& world_from_head, Rounding rounding);
  /// Completes read_state() with the decoded positions of the strands.
  void place(const tangent::Planes<int32_t>& decoded, float quantum_m);

  const State& state() const { return state_; }
  /// Continues from the state of another predictor of the same model and layout.
  void set_state(const State& state) { copy(state, state_); }
  /// Copies a state into memory that is kept if it fits.
  static void copy(const State& from, State& to);

  /// Saves the state, so that restore() can undo a frame that failed its checks.
  void save();
  void restore();

 private:
  /// A plane of the state besides positions, which write_state() writes for joiners.
  struct StatePlane {
    PlaneRole role;
    float step;           // of x, y and z
    float w_step = 0.0f;  // of w from the second vertex on, the first has the last substep; 0: there is none
    bool is_way = false;  // told beside velocity times the last substep
  };

  Predictor(StepModel model, const PredictorGround& ground);
  Status prepare();
  void fill_rest();
  void fill_fixed();
  Status prepare_volume(simd::InstructionSet set);
  Status prepare_mixed(simd::InstructionSet set);
  void run_volume(const StepBlock& block, const LanePlanes& planes);
  void fill_volume(const StepBlock& block);
  Status prepare_passes(simd::InstructionSet set);
  StepBlock block_of(const StepInput& input, Tips tips) const;
  LanePlanes bound_planes() const;
  void run_body(const StepInput& input, const StepBlock& block, LanePlanes planes);
  void run_field(const StepBlock& block, LanePlanes planes);
  void begin_body(const StepInput& first);
  void put_positions(const tangent::Planes<int32_t>& decoded, float quantum_m);
  void find_axes(StrandBlocks& axes) const;
  /// Axis of an edge, the one without twist, and what is at right angles to that.
  struct TwistedAxis {
    glm::vec3 axis;
    glm::vec3 found;
    glm::vec3 side;
  };
  /// A turn about an edge; both parts are to be multiplied with `scale`.
  struct TwistTurn {
    float cosine;
    float sine;
    float scale;
  };
  using StepsOfAxis = int32_t (*)(const TwistedAxis& axis, int32_t steps, int32_t steps_before);
  void twist(StepsOfAxis steps_of_axis, TwistTurn (*turn_of)(int32_t steps));
  static TwistTurn turn_of_steps(int32_t steps);
  static TwistTurn turn_of_fine_steps(int32_t steps);
  void turn(const glm::dquat& by);
  void run(const StepInput& input);
  void run_kind(const StepInput& input, Tips tips, LaneProgram& program);
  StrandBlocks* moving(PlaneRole role) const;
  std::vector<StatePlane> state_planes() const;
  float share_history();
  void settle_planes();
  template <class Steps>
  void visit_velocities(uint32_t slice, std::vector<glm::vec4>& changes, Steps steps);
  template <class Code>
  void visit_steps_beside(uint32_t slice, Code code) const;
  template <class Code>
  void visit_earlier_steps_beside(uint32_t slice, Code code) const;
  GuessedVelocities guessed_velocities() const;
  void place_velocities();
  void forget_history();
  void find_history(const StepInput& first);
  bool is_fine() const { return rounding_ != Rounding::Coarse; }
  const tangent::Neighbours& beside() const { return ground_.layout.*beside_of(rounding_); }
  void write_fine(ValueWriter& writer) const;
  void read_fine(ValueReader& reader);
  static void copy_blocks(const std::unique_ptr<StrandBlocks>& from, std::unique_ptr<StrandBlocks>& to);
  void write_slice(uint32_t slice, ValueWriter& writer) const;
  void write_planes(uint32_t slice, ComponentTables& tables, ValueWriter& writer) const;
  void read_planes(uint32_t slice, float history_s, ComponentTables& tables, ValueReader& reader);
  void read_slice(uint32_t slice, float history_s, ValueReader& reader);
  uint32_t block_count() const;
  template <class Work>
  void for_blocks(const Work& work) const {
    constexpr size_t kGrain = 32;
    const bool has_many = ground_.layout.plane_size() >= tangent::kManyVertices;
    ground_.workers.at(ground_.priority, has_many ? kMaxWorkers : 1)
        .for_ranges(block_count(), kGrain, [&](size_t begin, size_t end) {
          work(static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
        });
  }

  StepModel model_;
  StepScene scene_;
  PredictorGround ground_;
  const StepKernel& kernel_;
  uint32_t places_ = 0;  // of the layout, without its block of zeros
  std::array<std::unique_ptr<StrandBlocks>, kPlaneRoleCount> fixed_;
  State state_;
  State saved_;
  // By settle() or settle_finely(), for write_state().
  Rounding rounding_ = Rounding::Coarse;
  VelocityGuess guess_;                  // of Rounding::Fine
  std::vector<int32_t> velocity_steps_;  // (places x vertex_count x 3), of settle_finely()
  std::vector<int32_t> twist_steps_;     // (places x vertex_count)
  float history_s_ = 0.0f;               // last substep of strands that remember it
  std::optional<LaneProgram> program_;
  // Where strands of both kinds are: program_ is that of pinned tips.
  std::optional<LaneProgram> free_tips_program_;
  std::unique_ptr<TipMask> mixed_tips_;
  std::optional<LaneProgram> follicle_program_;
  // Where the model tells of a volume.
  std::unique_ptr<VolumeLaw> volume_;
  std::vector<glm::vec4> volume_table_;
  std::optional<LaneProgram> volume_program_;
  // What else the model tells of.
  std::optional<LaneProgram> drag_program_;
  std::optional<LaneProgram> bend_program_;
  std::optional<LaneProgram> body_program_;
  std::optional<LaneProgram> field_program_;
  std::unique_ptr<StrandBlocks> field_before_;  // of the ticks at work
  std::vector<glm::vec4> field_table_;
};

}  // namespace strandcast::step
