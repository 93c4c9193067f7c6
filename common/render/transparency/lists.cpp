// Per-pixel linked lists with a k-buffer (Yang et al. 2010; TressFX): the reference among the methods, and
// the one that takes the most memory. There is room for so many nodes per pixel in the mean; what finds none
// is counted.

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/gl/device_limits.h"
#include "common/render/transparency/transparency.h"
#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

constexpr uint64_t kNodeBytes = 16;
constexpr uint64_t kMaxListBytes = 512ull << 20;

class PixelLists final : public gl::Resource {
 public:
  explicit PixelLists(uint32_t nodes_per_pixel)
      : Resource("pixel lists"), nodes_per_pixel_(nodes_per_pixel) {}

  Status resize(glm::uvec2 size_px) {
    if (size_px == size_px_) return {};
    size_px_ = glm::uvec2(0);
    head_ = {};
    node_ = {};
    framebuffer_ = {};
    const uint64_t pixels = uint64_t{size_px.x} * size_px.y;
    const gl::DeviceLimits limits = gl::read_device_limits();
    RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::StorageBlockBytes, pixels * kNodeBytes,
                                           fmt::format("lists for {} x {} pixels", size_px.x, size_px.y)));
    // What one block can hold is the budget where the device has less.
    const uint64_t node_bytes =
        std::min({pixels * nodes_per_pixel_ * kNodeBytes, kMaxListBytes,
                  limits.of(gl::DeviceLimit::StorageBlockBytes) / kNodeBytes * kNodeBytes});
    head_ = gl::Buffer("list head", pixels * sizeof(uint32_t));
    node_ = gl::Buffer("list node", node_bytes);
    if (count_.size_bytes() == 0) count_ = gl::Buffer("list count", sizeof(Count));
    framebuffer_ = gl::Framebuffer::without_attachments("lists", size_px.x, size_px.y);
    size_px_ = size_px;
    return {};
  }
  void clear() const {
    glClearNamedBufferData(head_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    glClearNamedBufferData(count_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }
  void bind() const {
    head_.bind_storage(shader::kBindingListHead);
    node_.bind_storage(shader::kBindingListNode);
    count_.bind_storage(shader::kBindingListCount);
  }
  void begin() const {
    set_plain_state(size_px_);
    framebuffer_.bind();
    glDisable(GL_DEPTH_TEST);
    bind();
  }
  uint32_t room() const { return static_cast<uint32_t>(node_.size_bytes() / kNodeBytes); }
  uint32_t width() const { return size_px_.x; }
  /// Nodes that found no room, or stood at the end of a list that is too long. Waits for the GPU.
  uint64_t left_out() const {
    const Count count = count_.read_all<Count>().front();
    return count.left_out + (count.wanted > room() ? count.wanted - room() : 0);
  }
  uint64_t size_bytes() const override {
    return uint64_t{head_.size_bytes()} + node_.size_bytes() + count_.size_bytes();
  }

 private:
  struct Count {
    uint32_t wanted = 0;
    uint32_t left_out = 0;
  };
  uint32_t nodes_per_pixel_;
  gl::Buffer head_;
  gl::Buffer node_;
  gl::Buffer count_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

class ListsPass final : public StrandDrawPass {
 public:
  ListsPass(RenderScene& scene, ExpandedStrands& expanded, PixelLists& lists)
      : StrandDrawPass(scene, expanded,
                       strand_pass(scene, "render/lists", {&expanded, &scene.light, &scene.scene}, {&lists}),
                       "render/lists.frag"),
        lists_(lists) {}

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(lists_.resize(turn.size_px));
      lists_.clear();
    }
    lists_.begin();
    begin_blended(strands_, scene_, expanded_, turn);
    strands_.program().set("u_room", lists_.room());
    strands_.program().set("u_width", static_cast<int>(lists_.width()));
    strands_.draw(scene_, expanded_);
    return {};
  }

 private:
  PixelLists& lists_;
};

class ListsBlendPass final : public LayerBlendPass {
 public:
  ListsBlendPass(RenderScene& scene, PixelLists& lists)
      : LayerBlendPass(scene, "render/lists_blend", {&lists}, "render/lists_blend.frag"), lists_(lists) {}

  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(LayerBlendPass::run(turn));
    turn.left_out_fragments += lists_.left_out();
    return {};
  }

 private:
  void bind(const gl::Program& program) const override {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    lists_.bind();
    program.set("u_width", static_cast<int>(lists_.width()));
  }

  PixelLists& lists_;
};

}  // namespace

void add_lists(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& lists = passes.keep(std::make_unique<PixelLists>(scene.method_settings.list_nodes_per_pixel));
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<ListsPass>(scene, walks.expanded(), lists));
  passes.add(std::make_unique<ListsBlendPass>(scene, lists));
}

}  // namespace strandcast
