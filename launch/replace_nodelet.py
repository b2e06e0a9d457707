#!/usr/bin/env python3
"""Before `nodelet load TYPE MANAGER …`: a nodelet of that name that an earlier launch has left in the manager is unloaded. The
manager would refuse the new one, and the old one would go on with its old parameters."""

import signal
import sys

ANSWER = 5  # s that a manager may take


def hangs(*_):
    raise TimeoutError('the nodelet manager does not answer: does it hang, or is it stopped? Its loader waits for it')


def unload_old(command):
    import rosgraph.names
    namespace = rosgraph.names.get_ros_namespace()
    name = rosgraph.names.ns_join(namespace, rosgraph.names.load_mappings(command)['__name'])
    manager = rosgraph.names.ns_join(namespace, command[3])
    master = rosgraph.Master(name)
    try:
        master.lookupService(manager + '/list')
    except rosgraph.MasterError:
        return  # it begins with this launch
    signal.signal(signal.SIGALRM, hangs)
    signal.alarm(ANSWER)
    import rospy
    from nodelet.srv import NodeletList, NodeletUnload
    if name in rospy.ServiceProxy(manager + '/list', NodeletList)().nodelets:
        print('[ WARN] %s of an earlier launch is still in %s: it is replaced' % (name, manager), file=sys.stderr, flush=True)
        rospy.ServiceProxy(manager + '/unload_nodelet', NodeletUnload)(name)


if __name__ == '__main__':
    try:
        unload_old(sys.argv[1:])
    except Exception as problem:  # the loader names what is wrong with its arguments or the manager
        print('[ WARN] %s' % problem, file=sys.stderr, flush=True)
