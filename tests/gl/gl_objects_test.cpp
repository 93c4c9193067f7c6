#include <epoxy/gl.h>

#include <array>
#include <cstring>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/gl/timer.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::gl::gl_objects_test {
namespace {

class GlObjects : public GlTest {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }
};

TEST_F(GlObjects, BufferReturnsWhatWasWritten) {
  std::vector<uint32_t> values(1000);
  for (uint32_t i = 0; i < values.size(); ++i) values[i] = i * 2654435761u;
  Buffer buffer = Buffer::of("values", values);
  EXPECT_EQ(buffer.size_bytes(), values.size() * sizeof(uint32_t));
  EXPECT_EQ(buffer.read_all<uint32_t>(), values);
  const std::vector<uint32_t> two = {7, 8};
  buffer.write(4 * sizeof(uint32_t), std::as_bytes(std::span(two)));
  values[4] = 7;
  values[5] = 8;
  EXPECT_EQ(buffer.read_all<uint32_t>(), values);
}

TEST_F(GlObjects, FreshBuffersAreZeroAndEmptyOnesHaveNoName) {
  EXPECT_EQ(Buffer("fresh", 16).read_all<uint32_t>(), (std::vector<uint32_t>{0, 0, 0, 0}));
  const Buffer empty("empty", 0);
  EXPECT_EQ(empty.name(), 0u);
  EXPECT_TRUE(empty.read_all<uint32_t>().empty());
}

TEST_F(GlObjects, MovingLeavesExactlyOneOwner) {
  uint32_t name = 0;
  {
    Buffer first = Buffer::of("moved", std::vector<int>{1});
    name = first.name();
    const Buffer second = std::move(first);
    EXPECT_EQ(second.name(), name);
    EXPECT_EQ(glIsBuffer(name), GL_TRUE);
  }
  EXPECT_EQ(glIsBuffer(name), GL_FALSE);
}

TEST_F(GlObjects, AreCountedByKindWithTheirBytes) {
  const ObjectCounts before = object_counts();
  const auto more = [&](ObjectKind kind) { return object_counts().of(kind) - before.of(kind); };
  {
    Buffer buffer("counted", 100);
    const Buffer empty("empty", 0);
    const Texture plain("plain", GL_RGBA8, 4, 2, 1);
    const Texture samples("samples", GL_RGBA8, 4, 2, 4);
    const Texture volume = Texture::volume("volume", GL_RG16, 2, 3, 5);
    const Texture depths("depths", GL_DEPTH_COMPONENT32F, 4, 2, 1);
    const Texture stencils("stencils", GL_DEPTH24_STENCIL8, 2, 2, 4);
    const Framebuffer target = Framebuffer::without_attachments("target");
    const VertexArray vertices("vertices");
    EXPECT_EQ(more(ObjectKind::Buffer), 1u) << "an empty one has no name";
    EXPECT_EQ(more(ObjectKind::Texture), 5u);
    EXPECT_EQ(more(ObjectKind::Framebuffer), 1u);
    EXPECT_EQ(more(ObjectKind::VertexArray), 1u);
    EXPECT_EQ(more(ObjectKind::Program), 0u);
    EXPECT_EQ(object_counts().size_bytes - before.size_bytes,
              100u + 4u * 2 * 4 + 4u * 2 * 4 * 4 + 2u * 3 * 5 * 4 + 4u * 2 * 4 + 2u * 2 * 4 * 4);
    const Buffer moved = std::move(buffer);
    EXPECT_EQ(more(ObjectKind::Buffer), 1u);
    buffer = Buffer("another", 60);
    EXPECT_EQ(more(ObjectKind::Buffer), 2u);
  }
  EXPECT_EQ(object_counts(), before);
}

TEST_F(GlObjects, ProgramsAndContextsAreCountedToo) {
  const ObjectCounts before = object_counts();
  {
    TemporaryFolder folder;
    folder.write("point.vert", "void main() {\n  gl_Position = vec4(0.0);\n}\n");
    folder.write("wrong.vert", "void main() {\n  gl_Position = 1;\n}\n");
    const auto program = Program::make(ShaderLibrary(folder.path()), {"point.vert"}, {});
    ASSERT_TRUE(program) << program.error().to_string();
    EXPECT_FALSE(Program::make(ShaderLibrary(folder.path()), {"wrong.vert"}, {}));
    EXPECT_EQ(object_counts().of(ObjectKind::Program), before.of(ObjectKind::Program) + 1);
    EXPECT_EQ(object_counts().compiled_programs, before.compiled_programs + 1);
  }
  EXPECT_EQ(object_counts().of(ObjectKind::Program), before.of(ObjectKind::Program));
  EXPECT_EQ(object_counts().compiled_programs, before.compiled_programs + 1) << "since start, not now";
  {
    const auto other = EglContext::make("auto");
    ASSERT_TRUE(other);
    EXPECT_EQ(object_counts().contexts, before.contexts + 1);
  }
  EXPECT_EQ(object_counts().contexts, before.contexts);
  ASSERT_TRUE(context_->make_current());
}

TEST_F(GlObjects, AreLabelled) {
  const Buffer buffer("strand positions", 4);
  std::array<char, 64> label{};
  glGetObjectLabel(GL_BUFFER, buffer.name(), label.size(), nullptr, label.data());
  EXPECT_STREQ(label.data(), "strand positions");
}

TEST_F(GlObjects, AFramebufferClearsItsTexturesAndResolves) {
  const Texture color("color", GL_RGBA8, 4, 2, 4);
  const Texture depth("depth", GL_DEPTH_COMPONENT32F, 4, 2, 4);
  const Texture plain("plain", GL_RGBA8, 4, 2, 1);
  const std::array<const Texture*, 1> colors = {&color};
  const std::array<const Texture*, 1> plains = {&plain};
  const Framebuffer target("target", colors, &depth);
  const Framebuffer resolved("resolved", plains, nullptr);
  const std::array<float, 4> orange = {1.0f, 0.6f, 0.0f, 1.0f};
  glClearNamedFramebufferfv(target.name(), GL_COLOR, 0, orange.data());
  glBlitNamedFramebuffer(target.name(), resolved.name(), 0, 0, 4, 2, 0, 0, 4, 2, GL_COLOR_BUFFER_BIT,
                         GL_NEAREST);
  std::vector<uint8_t> pixels(4 * 2 * 4);
  glGetTextureImage(plain.name(), 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(pixels.size()),
                    pixels.data());
  for (size_t i = 0; i < pixels.size(); i += 4) {
    EXPECT_EQ(pixels[i], 255);
    EXPECT_EQ(pixels[i + 1], 153);  // 0.6 x 255
    EXPECT_EQ(pixels[i + 2], 0);
  }
}

TEST_F(GlObjects, ATextureTooLargeForTheDriverGivesAnErrorNotAFramebuffer) {
  GLint limit = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
  const Texture wide("wide", GL_RGBA8, static_cast<uint32_t>(limit) + 1, 1, 1);
  const Texture narrow("narrow", GL_RGBA8, 4, 2, 1);
  while (glGetError() != GL_NO_ERROR) {
  }
  const std::array<const Texture*, 1> too_wide{&wide};
  const auto refused = Framebuffer::make("scene", too_wide, nullptr);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(refused.error().message.find("scene of " + std::to_string(limit + 1) + " x 1"), std::string::npos)
      << refused.error().message;
  const std::array<const Texture*, 1> fitting{&narrow};
  EXPECT_TRUE(Framebuffer::make("scene", fitting, nullptr));
}

TEST_F(GlObjects, TransformFeedbackNeedsNoWindow) {
  TemporaryFolder folder;
  folder.write("squares.vert",
               "flat out uint square;\nvoid main() {\n  square = uint(gl_VertexID * gl_VertexID);\n"
               "  gl_Position = vec4(0.0);\n}\n");
  const auto program = Program::make(ShaderLibrary(folder.path()), {"squares.vert"}, {}, {"square"});
  ASSERT_TRUE(program) << program.error().to_string();
  const Buffer squares("squares", 8 * sizeof(uint32_t));
  const Framebuffer target = Framebuffer::without_attachments("feedback");
  const VertexArray vertices("no attributes");
  target.bind();
  vertices.bind();
  program->use();
  glEnable(GL_RASTERIZER_DISCARD);
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, squares.name());
  glBeginTransformFeedback(GL_POINTS);
  glDrawArrays(GL_POINTS, 0, 8);
  glEndTransformFeedback();
  EXPECT_EQ(squares.read_all<uint32_t>(), (std::vector<uint32_t>{0, 1, 4, 9, 16, 25, 36, 49}));
}

TEST_F(GlObjects, TheTimerCoversTheWorkBetween) {
  GpuTimer timer(context_->info());
  timer.begin();
  const double nothing_ms = timer.end_ms();
  EXPECT_GE(nothing_ms, 0.0);
  timer.begin();
  const Buffer buffer("cleared", 1 << 24);
  EXPECT_GT(timer.end_ms(), 0.0);
}

}  // namespace
}  // namespace strandcast::gl::gl_objects_test
