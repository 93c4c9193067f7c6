#include "common/pictures/image_codec.h"

#include <unistd.h>
#include <webp/mux.h>

#include <cmath>
#include <random>

#include "common/base/file.h"
#include "common/pictures/linear_png.h"

namespace strandcast::image_codec_test {
namespace {

Image smooth_image(uint32_t width, uint32_t height, int phase = 0) {
  Image image{width, height, {}};
  for (uint32_t y = 0; y < height; ++y) {
    for (uint32_t x = 0; x < width; ++x) {
      const auto wave = [&](double rate) {
        return static_cast<uint8_t>(127.5 + 100.0 * std::sin(rate * x + 0.05 * y + 0.3 * phase));
      };
      image.rgba.insert(image.rgba.end(), {wave(0.05), wave(0.02), wave(0.03), 255});
    }
  }
  return image;
}

double rms_difference(const Image& a, const Image& b) {
  double sum = 0.0;
  for (size_t i = 0; i < a.rgba.size(); ++i) sum += std::pow(static_cast<double>(a.rgba[i]) - b.rgba[i], 2.0);
  return std::sqrt(sum / static_cast<double>(a.rgba.size()));
}

class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / fmt::format("strandcast_image_{}", getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

TEST(Jpeg, KeepsSizeAndComesCloserWithQuality) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {17u, 5u}, {320u, 180u}}) {
    const Image image = smooth_image(width, height);
    double last_rms = 1e9;
    for (const int quality : {20, 60, 95}) {
      const auto bytes = encode_jpeg(image, quality);
      ASSERT_TRUE(bytes) << bytes.error().to_string();
      const auto decoded = decode_jpeg(*bytes);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      ASSERT_EQ(decoded->width, width);
      ASSERT_EQ(decoded->height, height);
      for (size_t i = 3; i < decoded->rgba.size(); i += 4) ASSERT_EQ(decoded->rgba[i], 255);
      const double rms = rms_difference(*decoded, image);
      EXPECT_LE(rms, last_rms + 0.5);
      last_rms = rms;
    }
    EXPECT_LT(last_rms, 3.0);
  }
}

TEST(Jpeg, RefusesWrongInput) {
  EXPECT_EQ(encode_jpeg(Image{}, 80).error().code, ErrorCode::BadInput);
  EXPECT_EQ(encode_jpeg(Image{2, 2, std::vector<uint8_t>(15)}, 80).error().code, ErrorCode::BadInput);
  EXPECT_EQ(encode_jpeg(smooth_image(8, 8), 0).error().code, ErrorCode::BadInput);
  EXPECT_EQ(encode_jpeg(smooth_image(8, 8), 101).error().code, ErrorCode::BadInput);
  EXPECT_EQ(encode_jpeg(smooth_image(kMaxImageSide + 1, 1), 80).error().code, ErrorCode::LimitExceeded);
  EXPECT_FALSE(decode_jpeg({}));
  const auto bytes = encode_jpeg(smooth_image(64, 64), 80);
  for (size_t size = 0; size < bytes->size(); size += 7)
    EXPECT_FALSE(decode_jpeg(std::span(*bytes).first(size))) << size;
}

TEST(Jpeg, ChecksTheAnnouncedSizeBeforeAllocating) {
  auto bytes = encode_jpeg(smooth_image(64, 64), 80);
  ASSERT_TRUE(bytes);
  // The frame header: FF C0, length, precision, height, width.
  for (size_t i = 0; i + 8 < bytes->size(); ++i) {
    if ((*bytes)[i] != std::byte{0xff} || (*bytes)[i + 1] != std::byte{0xc0}) continue;
    for (size_t k = 5; k < 9; ++k) (*bytes)[i + k] = std::byte{0x21};  // 8,481 pixels a side
    break;
  }
  const auto refused = decode_jpeg(*bytes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded) << refused.error().to_string();
}

TEST(Png, ComesBackExactlyAndRefusesDamage) {
  const Folder folder;
  Image image = smooth_image(33, 20);
  std::mt19937 random(1);
  for (uint8_t& value : image.rgba) value = static_cast<uint8_t>(random());
  ASSERT_TRUE(save_png(folder / "a.png", image));
  const auto loaded = load_png(folder / "a.png");
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_EQ(*loaded, image);
  const auto bytes = load_file(folder / "a.png", 1 << 20);
  for (size_t size = 0; size + 12 < bytes->size(); size += 50) {  // the end marker alone may be missing
    ASSERT_TRUE(save_file(folder / "b.png", std::span(*bytes).first(size)));
    EXPECT_FALSE(load_png(folder / "b.png")) << size;
  }
  auto huge = *bytes;
  for (size_t i = 16; i < 24; ++i)
    huge[i] = std::byte{0x70};  // width and height; the checksum breaks as well
  ASSERT_TRUE(save_file(folder / "b.png", huge));
  EXPECT_FALSE(load_png(folder / "b.png"));
  EXPECT_EQ(load_png(folder / "none.png").error().code, ErrorCode::NotFound);
  EXPECT_FALSE(save_png(folder / "no_such_folder/a.png", image));
  EXPECT_FALSE(save_png(folder / "a.png", Image{}));
}

TEST(ClipWriter, WritesEveryFrameWithItsDuration) {
  const Folder folder;
  auto writer = ClipWriter::make(folder / "clip.webp", 20.0);
  ASSERT_TRUE(writer);
  constexpr int kFrames = 6;
  for (int i = 0; i < kFrames; ++i) ASSERT_TRUE(writer->add(smooth_image(48, 32, i)));
  EXPECT_EQ(writer->add(smooth_image(32, 32)).error().code, ErrorCode::BadInput);
  ASSERT_TRUE(writer->finish());
  EXPECT_FALSE(writer->finish());

  const auto bytes = load_file(folder / "clip.webp", 1 << 20);
  ASSERT_TRUE(bytes);
  const WebPData data{reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()};
  WebPMux* mux = WebPMuxCreate(&data, 0);
  ASSERT_NE(mux, nullptr);
  int width = 0, height = 0, frames = 0;
  EXPECT_EQ(WebPMuxGetCanvasSize(mux, &width, &height), WEBP_MUX_OK);
  EXPECT_EQ(width, 48);
  EXPECT_EQ(height, 32);
  EXPECT_EQ(WebPMuxNumChunks(mux, WEBP_CHUNK_ANMF, &frames), WEBP_MUX_OK);
  EXPECT_EQ(frames, kFrames);
  for (int i = 1; i <= frames; ++i) {
    WebPMuxFrameInfo info;
    ASSERT_EQ(WebPMuxGetFrame(mux, static_cast<uint32_t>(i), &info), WEBP_MUX_OK);
    EXPECT_EQ(info.duration, 50);
    WebPDataClear(&info.bitstream);
  }
  WebPMuxDelete(mux);
}

TEST(ClipWriter, RefusesNonsense) {
  const Folder folder;
  for (const double rate : {0.0, -1.0, 1e9, std::nan("")})
    EXPECT_FALSE(ClipWriter::make(folder / "x.webp", rate));
  auto empty = ClipWriter::make(folder / "x.webp", 10.0);
  EXPECT_EQ(empty->finish().error().code, ErrorCode::BadInput);
  EXPECT_FALSE(std::filesystem::exists(folder / "x.webp"));
}

TEST(LinearPng, KeepsEveryStepOfLight) {
  const Folder folder;
  LinearImage image{5, 3, {}};
  for (uint32_t i = 0; i < 45; ++i) image.rgb.push_back(static_cast<uint16_t>(i * 1489));
  ASSERT_TRUE(save_linear_png(folder / "x.png", image));
  EXPECT_EQ(load_linear_png(folder / "x.png").value(), image);
}

TEST(LinearPng, RefusesNonsense) {
  const Folder folder;
  EXPECT_EQ(save_linear_png(folder / "x.png", {2, 2, {1, 2, 3}}).error().code, ErrorCode::BadInput);
  EXPECT_EQ(load_linear_png(folder / "x.png").error().code, ErrorCode::NotFound);
  // A picture of 8 bits is none of linear light.
  ASSERT_TRUE(save_png(folder / "x.png", {1, 1, {1, 2, 3, 255}}));
  EXPECT_EQ(load_linear_png(folder / "x.png").error().code, ErrorCode::BadInput);
}

}  // namespace
}  // namespace strandcast::image_codec_test
