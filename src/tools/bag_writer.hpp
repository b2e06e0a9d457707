#pragma once

#include <ros/message_traits.h>

#include <boost/make_shared.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>

#include "../ros/output_files.hpp"

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
      throw std::runtime_error("--output '" + path + "' is no regular file: choose another name");
    guard("create (does its directory exist, may I write there?)", [&] { bag_.emplace(partial_); });
  }
  ~BagWriter() {
    if (committed_) return;
    bag_.reset();
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { (*bag_)->write(topic, time, message); });
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
    guard("write", [&] { (*bag_)->write(topic, time, message, header); });
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
  std::optional<OutputBag> bag_;
  bool committed_ = false;
};

}  // namespace sdvo
