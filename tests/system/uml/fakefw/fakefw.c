// SPDX-License-Identifier: Apache-2.0 OR GPL-2.0-only
// Says of the virtual USB controller where the firmware knows it, as every real one can: libcamera names cameras by that.
#include <linux/module.h>
#include <linux/platform_device.h>

static struct device *controller;

static ssize_t path_show(struct device *device, struct device_attribute *attribute, char *text)
{
	return sysfs_emit(text, "\\_SB_.TEST.USB0\n");
}
static DEVICE_ATTR_RO(path);

static struct attribute *attributes[] = { &dev_attr_path.attr, NULL };
static const struct attribute_group group = { .name = "firmware_node", .attrs = attributes };

static int __init fakefw_init(void)
{
	int error;

	controller = bus_find_device_by_name(&platform_bus_type, NULL, "vhci_hcd.0");
	if (!controller)
		return -ENODEV;
	error = sysfs_create_group(&controller->kobj, &group);
	if (error)
		put_device(controller);
	return error;
}

static void __exit fakefw_exit(void)
{
	sysfs_remove_group(&controller->kobj, &group);
	put_device(controller);
}

module_init(fakefw_init);
module_exit(fakefw_exit);
MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("A place in the firmware for the virtual USB controller");
