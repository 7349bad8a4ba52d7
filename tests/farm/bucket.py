"""Waits for an S3 server and makes a bucket: bucket.py SERVER BUCKET"""
import sys
import time

import boto3
from botocore.exceptions import BotoCoreError

server, bucket = sys.argv[1:]
client = boto3.client("s3", endpoint_url=server, region_name="us-east-1", aws_access_key_id="key", aws_secret_access_key="secret")
for attempt in range(60):
    try:
        client.create_bucket(Bucket=bucket)
        break
    except BotoCoreError:
        if attempt == 59:
            raise
        time.sleep(0.5)
