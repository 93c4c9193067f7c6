#include "common/pictures/jpeg_tiles.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>

#include "common/pictures/image_check.h"
#include "common/pictures/picture.h"
#include "common/strands/byte_io.h"

namespace strandcast {
namespace {

constexpr size_t kTileChannels = 4;
constexpr size_t kTilePixelBytes = size_t{kTileSide} * kTileSide * kTileChannels;
/// A JPEG is at most 65,535 pixels high.
constexpr size_t kBatchTiles = 256;
constexpr uint8_t kMarker = 0xff;
constexpr uint8_t kStartOfFrame = 0xc0;
constexpr uint8_t kStartOfScan = 0xda;
constexpr uint8_t kRestartInterval = 0xdd;
constexpr uint8_t kFirstRestart = 0xd0;
constexpr uint8_t kEndOfImage = 0xd9;
constexpr size_t kRestartMarkers = 8;
constexpr size_t kMarkerBytes = 2;
constexpr size_t kHeightInFrame = 5;  // marker, length, precision
constexpr uint8_t kMaxQuality = 100;

int subsampling(TileChroma chroma) {
  return chroma == TileChroma::Full ? TJSAMP_444 : TJSAMP_420;
}

/// Restart intervals count blocks of the largest sampling: 16 x 16 pixels, or 8 x 8.
uint16_t units_per_tile(TileChroma chroma) {
  const uint32_t side = kTileSide / (chroma == TileChroma::Full ? 8 : 16);
  return static_cast<uint16_t>(side * side);
}

/// Where the scan data of a JPEG of ours begins, and where its frame header is.
struct Places {
  size_t frame = 0;
  size_t scan_marker = 0;
  size_t scan_data = 0;
};

std::optional<Places> find_places(std::span<const unsigned char> jpeg) {
  Places places;
  for (size_t at = kMarkerBytes; at + 4 <= jpeg.size();) {
    if (jpeg[at] != kMarker) return std::nullopt;
    const size_t length = static_cast<size_t>(jpeg[at + 2]) << 8 | jpeg[at + 3];
    if (jpeg[at + 1] == kStartOfFrame) places.frame = at;
    if (jpeg[at + 1] == kStartOfScan) {
      places.scan_marker = at;
      places.scan_data = at + kMarkerBytes + length;
      const bool is_complete = places.frame != 0 && places.scan_data <= jpeg.size();
      return is_complete ? std::optional(places) : std::nullopt;
    }
    at += kMarkerBytes + length;
  }
  return std::nullopt;
}

Result<CodedTile> cut_scan(std::span<const unsigned char> jpeg, uint8_t quality, TileChroma chroma) {
  const auto places = find_places(jpeg);
  if (!places || places->scan_data + kMarkerBytes > jpeg.size())
    return make_error(ErrorCode::Internal, "the JPEG encoder made a tile of unknown form");
  const auto scan =
      std::as_bytes(jpeg.subspan(places->scan_data, jpeg.size() - places->scan_data - kMarkerBytes));
  if (scan.size() > std::numeric_limits<uint16_t>::max())
    return make_error(ErrorCode::Internal, "a tile has {} bytes", scan.size());
  return CodedTile{quality, chroma, {scan.begin(), scan.end()}};
}

/// A scan that holds a marker would be more than one tile, or something else altogether.
bool has_marker(std::span<const std::byte> scan) {
  for (size_t i = 0; i < scan.size(); ++i) {
    if (scan[i] != std::byte{kMarker}) continue;
    if (i + 1 == scan.size() || scan[i + 1] != std::byte{0}) return true;
    ++i;
  }
  return false;
}

void blit(std::span<const uint8_t> tile, uint32_t index, Image& canvas) {
  const uint32_t columns = tiles_along(canvas.width);
  const uint32_t left = index % columns * kTileSide, top = index / columns * kTileSide;
  const size_t row_bytes = std::min(kTileSide, canvas.width - left) * kTileChannels;
  const uint32_t rows = std::min(kTileSide, canvas.height - top);
  for (uint32_t y = 0; y < rows; ++y)
    std::memcpy(canvas.rgba.data() + ((size_t{top} + y) * canvas.width + left) * kTileChannels,
                tile.data() + size_t{y} * kTileSide * kTileChannels, row_bytes);
}

}  // namespace

void TileEncoder::FreeTurbo::operator()(void* handle) const {
  tjDestroy(handle);
}
void TileDecoder::FreeTurbo::operator()(void* handle) const {
  tjDestroy(handle);
}

std::vector<std::byte> pack_tiles(uint32_t width, uint32_t height, std::span<const PlacedTile> tiles) {
  size_t bytes = kTilesFixedBytes;
  for (const PlacedTile& placed : tiles) bytes += kTileHeaderBytes + placed.tile->scan.size();
  std::vector<std::byte> payload(bytes);
  std::byte* next = payload.data();
  const auto put_u16 = [&next](size_t value) {
    *next++ = static_cast<std::byte>(value & 0xff);
    *next++ = static_cast<std::byte>(value >> 8);
  };
  for (const size_t value : {size_t{width}, size_t{height}, tiles.size(), size_t{0}}) put_u16(value);
  for (const PlacedTile& placed : tiles) {
    put_u16(placed.index);
    *next++ = static_cast<std::byte>(placed.tile->quality);
    *next++ = static_cast<std::byte>(placed.tile->chroma);
    put_u16(placed.tile->scan.size());
    next = std::copy(placed.tile->scan.begin(), placed.tile->scan.end(), next);
  }
  return payload;
}

Result<TileEncoder> TileEncoder::make() {
  void* turbo = tjInitCompress();
  if (turbo == nullptr) return make_error(ErrorCode::Internal, "cannot start the JPEG encoder");
  return TileEncoder(turbo);
}

Result<CodedTile> TileEncoder::encode(const Image& image, uint32_t index, uint8_t quality,
                                      TileChroma chroma) {
  const uint32_t columns = tiles_along(image.width);
  const uint32_t left = index % columns * kTileSide, top = index / columns * kTileSide;
  const uint32_t columns_left = image.width - left, rows_left = image.height - top;
  const uint8_t* source = image.rgba.data() + (size_t{top} * image.width + left) * kTileChannels;
  size_t pitch = size_t{image.width} * kTileChannels;
  if (columns_left < kTileSide || rows_left < kTileSide) {
    padded_.resize(kTilePixelBytes);
    for (uint32_t y = 0; y < kTileSide; ++y) {
      const uint8_t* row = source + std::min(y, rows_left - 1) * pitch;
      for (uint32_t x = 0; x < kTileSide; ++x)
        std::memcpy(padded_.data() + (size_t{y} * kTileSide + x) * kTileChannels,
                    row + std::min(x, columns_left - 1) * kTileChannels, kTileChannels);
    }
    source = padded_.data();
    pitch = size_t{kTileSide} * kTileChannels;
  }
  jpeg_.resize(tjBufSize(kTileSide, kTileSide, TJSAMP_444));
  unsigned char* bytes = jpeg_.data();
  unsigned long size = jpeg_.size();
  if (tjCompress2(turbo_.get(), source, kTileSide, static_cast<int>(pitch), kTileSide, TJPF_RGBA, &bytes,
                  &size, subsampling(chroma), quality, TJFLAG_NOREALLOC) != 0)
    return make_error(ErrorCode::Internal, "cannot encode a tile ({})", tjGetErrorStr2(turbo_.get()));
  return cut_scan(std::span(jpeg_).first(size), quality, chroma);
}

Result<std::span<const std::byte>> TileDecoder::header_of(const Kind& kind) {
  auto& header = headers_[kind];
  if (!header.empty()) return std::span<const std::byte>(header);
  const std::unique_ptr<void, FreeTurbo> turbo(tjInitCompress());
  if (!turbo) return make_error(ErrorCode::Internal, "cannot start the JPEG encoder");
  const std::vector<uint8_t> black(kTilePixelBytes);
  std::vector<unsigned char> jpeg(tjBufSize(kTileSide, kTileSide, TJSAMP_444));
  unsigned char* bytes = jpeg.data();
  unsigned long size = jpeg.size();
  const int failed = tjCompress2(turbo.get(), black.data(), kTileSide, 0, kTileSide, TJPF_RGBA, &bytes, &size,
                                 subsampling(kind.second), kind.first, TJFLAG_NOREALLOC);
  const auto places = failed == 0 ? find_places(std::span(jpeg).first(size)) : std::nullopt;
  if (!places) return make_error(ErrorCode::Internal, "cannot make the header of a tile");
  const auto all = std::as_bytes(std::span(jpeg));
  header.assign(all.begin(), all.begin() + static_cast<ptrdiff_t>(places->scan_marker));
  const uint16_t units = units_per_tile(kind.second);
  for (const int value : {int{kMarker}, int{kRestartInterval}, 0, 4, units >> 8, units & 0xff})
    header.push_back(static_cast<std::byte>(value));
  const auto scan_header = all.subspan(places->scan_marker, places->scan_data - places->scan_marker);
  header.insert(header.end(), scan_header.begin(), scan_header.end());
  return std::span<const std::byte>(header);
}

/// Pixels: one tile below the other.
Status TileDecoder::decode_batch(const Kind& kind, std::span<const Parsed> tiles, std::span<uint8_t> pixels) {
  if (!turbo_) turbo_.reset(tjInitDecompress());
  if (!turbo_) return make_error(ErrorCode::Internal, "cannot start the JPEG decoder");
  ASSIGN_OR_RETURN(const auto header, header_of(kind));
  std::vector<std::byte> jpeg(header.begin(), header.end());
  const auto places = find_places({reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size()});
  if (!places) return make_error(ErrorCode::Internal, "cannot read the header of a tile");
  const size_t height = tiles.size() * kTileSide;
  jpeg[places->frame + kHeightInFrame] = static_cast<std::byte>(height >> 8);
  jpeg[places->frame + kHeightInFrame + 1] = static_cast<std::byte>(height & 0xff);
  for (size_t i = 0; i < tiles.size(); ++i) {
    jpeg.insert(jpeg.end(), tiles[i].scan.begin(), tiles[i].scan.end());
    const bool is_last = i + 1 == tiles.size();
    jpeg.push_back(std::byte{kMarker});
    jpeg.push_back(static_cast<std::byte>(is_last ? kEndOfImage : kFirstRestart + i % kRestartMarkers));
  }
  // Without FASTUPSAMPLE the colours of a tile would run into the next one in this tall picture.
  const int failed = tjDecompress2(turbo_.get(), reinterpret_cast<const unsigned char*>(jpeg.data()),
                                   jpeg.size(), pixels.data(), kTileSide, 0, static_cast<int>(height),
                                   TJPF_RGBA, TJFLAG_STOPONWARNING | TJFLAG_FASTUPSAMPLE);
  if (failed != 0)
    return make_error(ErrorCode::BadInput, "damaged picture tiles ({})", tjGetErrorStr2(turbo_.get()));
  return {};
}

Status TileDecoder::decode(std::span<const std::byte> payload, Scope scope, Image& canvas) {
  ByteReader reader(payload);
  const uint32_t width = reader.take<uint16_t>();
  const uint32_t height = reader.take<uint16_t>();
  const uint32_t count = reader.take<uint16_t>();
  (void)reader.take<uint16_t>();
  if (!reader.ok()) return make_error(ErrorCode::BadInput, "picture tiles end in their header");
  RETURN_IF_ERROR(check_picture_size(width, height));
  const uint32_t all = tiles_along(width) * tiles_along(height);
  if (scope == Scope::Changes && (width != canvas.width || height != canvas.height))
    return make_error(ErrorCode::BadInput, "changes for a picture of {} x {}, shown is one of {} x {}", width,
                      height, canvas.width, canvas.height);
  if (count > all || (scope == Scope::Whole && count != all))
    return make_error(ErrorCode::BadInput, "{} tiles for a picture of {}", count, all);

  std::map<Kind, std::vector<Parsed>> kinds;
  int64_t last_index = -1;
  for (uint32_t i = 0; i < count; ++i) {
    Parsed parsed;
    parsed.index = reader.take<uint16_t>();
    const auto quality = reader.take<uint8_t>();
    const auto chroma = reader.take<uint8_t>();
    parsed.scan = reader.take_bytes(reader.take<uint16_t>());
    if (!reader.ok()) return make_error(ErrorCode::BadInput, "picture tiles end in tile {} of {}", i, count);
    if (parsed.index <= last_index || parsed.index >= all)
      return make_error(ErrorCode::BadInput, "tile {} after tile {} of {}", parsed.index, last_index, all);
    last_index = parsed.index;
    if (quality < 1 || quality > kMaxQuality || chroma > static_cast<uint8_t>(TileChroma::Full))
      return make_error(ErrorCode::BadInput, "a tile of quality {} and chroma {}", quality, chroma);
    if (parsed.scan.empty() || has_marker(parsed.scan))
      return make_error(ErrorCode::BadInput, "tile {} holds no scan of one tile", parsed.index);
    kinds[{quality, static_cast<TileChroma>(chroma)}].push_back(parsed);
  }
  if (!reader.rest().empty())
    return make_error(ErrorCode::BadInput, "{} bytes behind the last tile", reader.rest().size());

  std::vector<uint8_t> pixels(count * kTilePixelBytes);
  std::vector<uint16_t> places;
  for (const auto& [kind, tiles] : kinds)
    for (size_t first = 0; first < tiles.size(); first += kBatchTiles) {
      const auto batch = std::span(tiles).subspan(first, std::min(kBatchTiles, tiles.size() - first));
      RETURN_IF_ERROR(decode_batch(kind, batch, std::span(pixels).subspan(places.size() * kTilePixelBytes)));
      for (const Parsed& tile : batch) places.push_back(tile.index);
    }
  if (scope == Scope::Whole) {
    canvas.width = width;
    canvas.height = height;
    canvas.rgba.resize(size_t{width} * height * kTileChannels);
  }
  for (size_t i = 0; i < places.size(); ++i)
    blit(std::span(pixels).subspan(i * kTilePixelBytes, kTilePixelBytes), places[i], canvas);
  return {};
}

}  // namespace strandcast
