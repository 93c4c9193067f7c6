#include "server/net/asset_forms.h"

#include <algorithm>
#include <span>

#include "common/strands/asset/layout.h"
#include "common/strands/byte_io.h"

namespace strandcast {

EncodedFramePtr AssetForms::fit(const EncodedFramePtr& asset, uint32_t newest) {
  if (asset == nullptr) return asset;
  const auto payload = std::span(asset->message).subspan(kFrameHeaderBytes);
  const auto layout = ByteReader(payload).take<uint32_t>();
  if (layout <= newest || layout <= static_cast<uint32_t>(AssetLayout::Floats)) return asset;
  if (from_ != asset) translated_ = {};
  from_ = asset;
  const auto taken = std::max(static_cast<AssetLayout>(newest), AssetLayout::Floats);
  EncodedFramePtr& translated = translated_[taken == AssetLayout::Floats ? 0 : 1];
  if (translated != nullptr) return translated;
  translated = asset;
  if (const auto decoded = decode_scene_asset(payload)) {
    auto frame = make_encoded_frame(asset->header, encode_scene_asset(*decoded, taken));
    if (frame != nullptr) translated = std::move(frame);
  }
  return translated;
}

}  // namespace strandcast
