#include "common/render/passes/expand_walks.h"

#include <utility>

namespace strandcast {
namespace {

gl::PassDeclaration declare(const RenderPass& expand, const std::string& purpose) {
  gl::PassDeclaration declaration = expand.declaration();
  if (!purpose.empty()) declaration.name += "_" + purpose;
  return declaration;
}

class FirstWalk final : public RenderPass {
 public:
  FirstWalk(std::shared_ptr<ExpandWalks::Shared> shared, const std::string& purpose)
      : Pass(declare(*shared->expand, purpose)), shared_(std::move(shared)), is_early_(!purpose.empty()) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override { return shared_->expand->size_bytes(); }
  Status prepare(const RenderSetup& setup) override {
    if (is_early_) nothing_ = gl::Framebuffer::without_attachments("expand");
    return shared_->expand->prepare(setup);
  }
  Status run(RenderTurn& turn) override {
    if (is_early_) nothing_.bind();
    shared_->batch_count = turn.batch_index + 1;
    return shared_->expand->run(turn);
  }

 private:
  std::shared_ptr<ExpandWalks::Shared> shared_;
  // In front of all that draws no target is bound yet, and there is no expansion without one.
  bool is_early_;
  gl::Framebuffer nothing_;
};

/// Strands are counted once, however often they are walked over.
class LaterWalk final : public RenderPass {
 public:
  LaterWalk(std::shared_ptr<ExpandWalks::Shared> shared, const std::string& purpose)
      : Pass(declare(*shared->expand, purpose)), shared_(std::move(shared)) {}

  bool is_batched() const override { return true; }
  Status run(RenderTurn& turn) override {
    if (shared_->batch_count == 1) return {};
    const auto [strands, segments] = std::pair(turn.drawn_strands, turn.drawn_segments);
    Status status = shared_->expand->run(turn);
    turn.drawn_strands = strands;
    turn.drawn_segments = segments;
    return status;
  }

 private:
  std::shared_ptr<ExpandWalks::Shared> shared_;
};

}  // namespace

ExpandWalks::ExpandWalks(std::unique_ptr<RenderPass> expand, ExpandedStrands& expanded)
    : shared_(std::make_shared<Shared>()), expanded_(expanded) {
  shared_->expand = std::move(expand);
}

std::unique_ptr<RenderPass> ExpandWalks::add(const std::string& purpose) {
  if (std::exchange(has_first_, true)) return std::make_unique<LaterWalk>(shared_, purpose);
  return std::make_unique<FirstWalk>(shared_, purpose);
}

}  // namespace strandcast
