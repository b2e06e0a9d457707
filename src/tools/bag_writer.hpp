#pragma once

#include <ros/message_traits.h>
#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

namespace sdvo {

/// A bag that appears under its name only once it is complete; removed when something failed before.
class BagWriter {
 public:
  BagWriter(const std::string& path, const std::string& tool)
      : final_(path), partial_(path + ".active"), caller_("/" + tool) {
    if (std::filesystem::is_directory(final_))
      throw std::runtime_error("--output '" + path + "' is a directory, not a file name");
    // A device or a pipe would be replaced by the bag.
    if (std::filesystem::exists(final_) && !std::filesystem::is_regular_file(final_))
      throw std::runtime_error("--output '" + path + "' is no regular file");
    guard("create (does its directory exist, may I write there?)",
          [&] { bag_->open(partial_, rosbag::bagmode::Write); });
  }
  ~BagWriter() {
    if (committed_) return;
    // rosbag closes (writes an index) in its destructor and ends the process when that fails, as it would on a full
    // disk; the process is about to end anyway, so the object is left behind instead, in reach:
    // a leak would be reported.
    [[maybe_unused]] static rosbag::Bag* volatile left_behind;
    left_behind = bag_.release();
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { bag_->write(topic, time, message); });
  }

  /// As write(), but `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = caller_;
    (*header)["latching"] = "1";
    (*header)["type"] = ros::message_traits::datatype<Message>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
    (*header)["message_definition"] = ros::message_traits::definition<Message>();
    guard("write", [&] { bag_->write(topic, time, message, header); });
  }

  void commit() {
    guard("write", [&] {
      bag_->close();
      std::filesystem::rename(partial_, final_);
    });
    committed_ = true;
  }

 private:
  template <class Action>
  void guard(const std::string& what, const Action& action) const {
    try {
      action();
    } catch (const std::exception& e) {
      throw std::runtime_error("--output '" + final_ + "': cannot " + what + ": " + e.what());
    }
  }

  std::string final_, partial_, caller_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  bool committed_ = false;
};

}  // namespace sdvo
