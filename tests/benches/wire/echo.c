/* Sends every joint state that comes on `ping` back on `pong`: as little as a DDS node can do.
 * idlc -l c joint_state.idl && cc -O2 -o echo echo.c joint_state.c -lddsc */
#include "dds/dds.h"
#include "joint_state.h"
#include <stdio.h>
#include <stdlib.h>

#define TYPE sensor_msgs_msg_dds__JointState_

int main(void) {
  const char *domain = getenv("ROS_DOMAIN_ID");
  dds_entity_t participant = dds_create_participant(domain ? (dds_domainid_t)atoi(domain) : 0, NULL, NULL);
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  dds_entity_t ping = dds_create_topic(participant, &sensor_msgs_msg_dds__JointState__desc, "rt/ping", qos, NULL);
  dds_entity_t pong = dds_create_topic(participant, &sensor_msgs_msg_dds__JointState__desc, "rt/pong", qos, NULL);
  dds_entity_t reader = dds_create_reader(participant, ping, qos, NULL);
  dds_entity_t writer = dds_create_writer(participant, pong, qos, NULL);
  dds_entity_t waitset = dds_create_waitset(participant);
  dds_entity_t data = dds_create_readcondition(reader, DDS_ANY_STATE);
  dds_waitset_attach(waitset, data, 0);
  if (participant < 0 || reader < 0 || writer < 0 || waitset < 0) {
    fprintf(stderr, "no Cyclone: %s\n", dds_strretcode(-participant));
    return 1;
  }
  puts("ready");
  fflush(stdout);
  for (;;) {
    dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY);
    void *samples[1] = {NULL};
    dds_sample_info_t info[1];
    int count;
    while ((count = dds_take(reader, samples, info, 1, 1)) > 0) {
      if (info[0].valid_data)
        dds_write(writer, samples[0]);
      dds_return_loan(reader, samples, count);
    }
  }
}
