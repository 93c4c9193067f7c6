#include "server/net/asset_forms.h"

#include <span>

#include "common/strands/asset/layout.h"
#include "common/strands/byte_io.h"

namespace strandcast {

EncodedFramePtr AssetForms::fit(const EncodedFramePtr& asset, uint32_t newest) {
  if (asset == nullptr) return asset;
  const auto payload = std::span(asset->message).subspan(kFrameHeaderBytes);
  const auto layout = ByteReader(payload).take<uint32_t>();
  if (layout <= newest || layout <= static_cast<uint32_t>(AssetLayout::Floats)) return asset;
  if (from_ == asset) return translated_;
  from_ = translated_ = asset;
  if (const auto decoded = decode_scene_asset(payload)) {
    auto frame = make_encoded_frame(asset->header, encode_scene_asset(*decoded, AssetLayout::Floats));
    if (frame != nullptr) translated_ = std::move(frame);
  }
  return translated_;
}

}  // namespace strandcast
