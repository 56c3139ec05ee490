#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <boost/make_shared.hpp>
#include <geometry_msgs/TransformStamped.h>
#include <message_filters/pass_through.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <openpose_ros_msgs/joints.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/PointCloud2.h>

#include "openpose_ros_nodelets/common/organized_cloud.h"
#include "openpose_ros_nodelets/common/stream_nodelet.h"
#include "openpose_ros_nodelets/common/transforms.h"
#include "openpose_ros_nodelets/people_cloud/labelled_cloud.h"
#include "openpose_ros_nodelets/people_cloud/people_labeller.h"

namespace openpose_ros_nodelets
{
namespace
{

using openpose_ros_msgs::BodypartDetection_3d;
using openpose_ros_msgs::PersonDetection_3d;
using openpose_ros_msgs::PersonDetection_3dArray;
using sensor_msgs::PointCloud2;

static_assert(std::size(openpose_ros_msgs::COCO_18_JOINTS) == JOINTS, "the same joints, in the same order");

// Of an inferred joint whose standard deviation is not known [m].
constexpr float UNKNOWN_SIGMA = 0.15f;
// People are published with the transform at hand, which may come here a little later [s].
constexpr double TRANSFORM_PATIENCE = 0.1;

Skeleton skeletonOf(const PersonDetection_3d& person, const Eigen::Isometry3f& to_cloud)
{
  Skeleton skeleton;
  for (std::size_t joint = 0; joint < JOINTS; ++joint)
  {
    const BodypartDetection_3d& part = openpose_ros_msgs::partOf(person, openpose_ros_msgs::COCO_18_JOINTS[joint]);
    if (!openpose_ros_msgs::isKnown(part))
      continue;
    skeleton.position[joint] = to_cloud * Eigen::Vector3f(part.x, part.y, part.z);
    if (part.status == BodypartDetection_3d::INFERRED)
      skeleton.uncertainty[joint] = std::isfinite(part.sigma) ? part.sigma : UNKNOWN_SIGMA;
  }
  return skeleton;
}

}  // namespace

/// Cloud and people of the same stamp -> the cloud with a label for each point, and the cloud without the people.
class PeopleCloud : public StreamNodelet
{
private:
  using Policy = message_filters::sync_policies::ExactTime<PointCloud2, PersonDetection_3dArray>;

  void configure(ParameterReader& parameters) override
  {
    LabelSettings settings;
    settings.looseness = parameters.number("looseness", settings.looseness, 0.2, 3.0);
    settings.cluster_step = parameters.number("cluster_step", settings.cluster_step, 0.001, 0.2);
    settings.floor_margin = parameters.number("floor_margin", settings.floor_margin, 0.001, 0.2);
    labeller_ = std::make_unique<PeopleLabeller>(settings);
    queue_size_ = parameters.integer("queue_size", 30, 1, 1000);
    transforms_ = std::make_unique<Transforms>(*nh_);
    labelled_publisher_ = advertise<PointCloud2>(*pnh_, "labelled", 1);
    without_people_publisher_ = advertise<PointCloud2>(*pnh_, "without_people", 1);
  }

  void subscribe() override
  {
    synchronizer_ = std::make_unique<message_filters::Synchronizer<Policy>>(Policy(queue_size_), clouds_, people_);
    synchronizer_->getPolicy()->setReset(true);
    synchronizer_->registerCallback(&PeopleCloud::label, this);
    synchronizer_->getPolicy()->registerDropCallback(&PeopleCloud::countDropped, this);
    cloud_subscriber_ = listen<PointCloud2>("points", queue_size_, [this](const auto& cloud) { clouds_.add(cloud); });
    people_subscriber_ =
        listen<PersonDetection_3dArray>("people", queue_size_, [this](const auto& people) { people_.add(people); });
  }

  void unsubscribe() override
  {
    cloud_subscriber_.shutdown();
    people_subscriber_.shutdown();
    synchronizer_.reset();  // and the clouds that wait
  }

  void countDropped(const sensor_msgs::PointCloud2ConstPtr& cloud,
                    const openpose_ros_msgs::PersonDetection_3dArrayConstPtr& people)
  {
    if (cloud)
      health().count("clouds without people");  // detection does not look at every cloud
    if (people)
      health().warn("people without cloud", "no cloud has the stamp " + std::to_string(people->header.stamp.toSec()));
  }

  void label(const sensor_msgs::PointCloud2ConstPtr& cloud,
             const openpose_ros_msgs::PersonDetection_3dArrayConstPtr& people)
  {
    convertFrame(cloud->header.stamp, [&] {
      const OrganizedCloud points(*cloud);
      requireDepth(points);
      const Eigen::Isometry3f to_cloud = transform(people->header.frame_id, cloud->header);
      std::vector<Skeleton> skeletons;
      std::vector<std::uint32_t> ids{ 0 };
      for (const PersonDetection_3d& person : people->persons)
      {
        skeletons.push_back(skeletonOf(person, to_cloud));
        ids.push_back(person.person_ID);
      }
      if (std::set<std::uint32_t>(ids.begin(), ids.end()).size() < ids.size())
        std::iota(ids.begin(), ids.end(), 0);  // an id is there twice, or 0, which is the scene
      const std::vector<std::uint32_t>& numbers = labeller_->label(points, skeletons);
      if (without_people_publisher_.getNumSubscribers() > 0)
        without_people_publisher_.publish(withoutLabelled(*cloud, numbers));
      if (labelled_publisher_.getNumSubscribers() > 0)
      {
        std::vector<std::uint32_t> labels(numbers.size());
        std::transform(numbers.begin(), numbers.end(), labels.begin(),
                       [&](std::uint32_t number) { return ids[number]; });
        labelled_publisher_.publish(withLabels(*cloud, labels));
      }
    });
  }

  /// Return the transform from the frame of the people to that of the cloud, at its stamp. Throws TransformException.
  Eigen::Isometry3f transform(const std::string& frame, const std_msgs::Header& cloud) const
  {
    Eigen::Isometry3f transform = Eigen::Isometry3f::Identity();
    if (frame == cloud.frame_id)
      return transform;
    geometry_msgs::Transform found;
    try
    {
      found = transforms_->lookup(cloud.frame_id, frame, cloud.stamp, ros::WallDuration(TRANSFORM_PATIENCE)).transform;
    }
    catch (const tf2::TransformException& error)
    {
      throw tf2::TransformException("from '" + frame + "' to '" + cloud.frame_id + "': " + error.what());
    }
    transform.translate(Eigen::Vector3f(found.translation.x, found.translation.y, found.translation.z));
    transform.rotate(Eigen::Quaternionf(found.rotation.w, found.rotation.x, found.rotation.y, found.rotation.z));
    return transform;
  }

  std::unique_ptr<PeopleLabeller> labeller_;
  int queue_size_;
  std::unique_ptr<Transforms> transforms_;
  message_filters::PassThrough<PointCloud2> clouds_;
  message_filters::PassThrough<PersonDetection_3dArray> people_;
  ros::Subscriber cloud_subscriber_, people_subscriber_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchronizer_;
  ros::Publisher labelled_publisher_, without_people_publisher_;
};

}  // namespace openpose_ros_nodelets

PLUGINLIB_EXPORT_CLASS(openpose_ros_nodelets::PeopleCloud, nodelet::Nodelet)
