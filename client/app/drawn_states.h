// States of another source, whose strands an export writes as viewers draw them, or with what their files
// say. One thread.
#pragma once

#include <memory>

#include "client/export/export_source.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Returns the source with keys, followers, style and taper of a look. Errors of DrawnHair::make().
Result<std::unique_ptr<ExportSource>> as_drawn(std::unique_ptr<ExportSource> source, const LookDesc& look);

/// Returns the source with what the hair's files say of it.
std::unique_ptr<ExportSource> with_origin(std::unique_ptr<ExportSource> source,
                                          std::shared_ptr<const ExportOrigin> origin);

}  // namespace strandcast
