#include "live_record.hpp"

#include <rosbag/view.h>

#include <cmath>
#include <numeric>

namespace sdvo {

using stereo_descriptor_vo::VoInfo;

int LiveRecord::pairs() const {
  return std::accumulate(states.begin(), states.end(), 0);
}

std::optional<LiveRecord> readLiveRecord(const rosbag::Bag& bag) {
  LiveRecord record;
  std::string topic;
  std::optional<VoInfo> before;
  for (const rosbag::MessageInstance& instance :
       rosbag::View(bag, rosbag::TypeQuery(ros::message_traits::datatype<VoInfo>()))) {
    if (topic.empty()) topic = instance.getTopic();
    const VoInfo::ConstPtr info = instance.getTopic() == topic ? instance.instantiate<VoInfo>() : nullptr;
    if (!info || info->state_id >= record.states.size()) continue;
    ++record.states[info->state_id];
    if (std::isfinite(info->latency)) record.latencies.push_back(info->latency);
    if (before && (before->epoch != info->epoch || before->session != info->session)) ++record.discontinuities;
    record.dropped_pairs = info->dropped_pairs + info->dropped_features;
    before = *info;
  }
  return before ? std::optional(record) : std::nullopt;
}

}  // namespace sdvo
